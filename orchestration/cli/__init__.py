"""The command line: one file here per command. An error a user can mend is one message and exit code 2."""

from __future__ import annotations

import shlex
from collections.abc import Callable

import typer

from ..errors import CosimError
from . import (
    animate,
    chart,
    export,
    halving,
    modes,
    monolith,
    paper,
    peers,
    reference,
    report,
    run,
    scenes,
    select,
    stability,
    sweep,
    timing,
    verify,
)
from .console import reported

__all__ = ["app"]

app = typer.Typer(
    rich_markup_mode="markdown",
    no_args_is_help=True,
    add_completion=False,
    help="Co-simulation of soft manipulators driven by TCAs.",
)

_COMMANDS: dict[str, Callable[..., None]] = {
    "run": run.command,
    "timing": timing.command,
    "paper": paper.command,
    "export": export.command,
    "list": scenes.command,
    "reference": reference.command,
    "monolith": monolith.command,
    "modes": modes.command,
    "stability": stability.command,
    "sweep": sweep.command,
    "select": select.command,
    "report": report.command,
    "animate": animate.command,
    "chart": chart.command,
    "halving": halving.command,
    "peers": peers.command,
    "verify": verify.command,
}
for name, command in _COMMANDS.items():
    app.command(name)(command)


@app.command("fit", hidden=True, context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
def _renamed(context: typer.Context) -> None:
    """Names the command that `fit` has become."""
    with reported():
        raise CosimError(f"fit is now called select: run `{shlex.join(['tca-cosim', 'select', *context.args])}`")
