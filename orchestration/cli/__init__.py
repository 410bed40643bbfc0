"""The command line: one module per command. An error that a user can mend is one message and exit code 2."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from typing import Annotated, Any

import typer

from ..errors import CosimError
from ..results.dataset import versions
from . import (
    animate,
    chart,
    explain,
    export,
    halving,
    linearise,
    modes,
    monolith,
    new,
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
from .console import out, reported
from .encoding import require_utf8

__all__ = ["app"]


class _App(typer.Typer):
    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        require_utf8()
        return super().__call__(*args, **kwargs)


app = _App(
    rich_markup_mode="markdown",
    no_args_is_help=True,
    add_completion=False,
    help="Co-simulation of soft manipulators driven by twisted-and-coiled actuators (TCAs), and of any FMUs.",
)

# Group of the help -> commands.
_COMMANDS: dict[str, dict[str, Callable[..., None]]] = {
    "Simulate": {
        "new": new.command,
        "run": run.command,
        "list": scenes.command,
        "explain": explain.command,
        "export": export.command,
    },
    "Look at results": {"report": report.command, "animate": animate.command},
    "Verify": {
        "verify": verify.command,
        "monolith": monolith.command,
        "reference": reference.command,
        "paper": paper.command,
    },
    "Study": {
        "sweep": sweep.command,
        "select": select.command,
        "modes": modes.command,
        "linearise": linearise.command,
        "stability": stability.command,
    },
    "Benchmark": {
        "timing": timing.command,
        "chart": chart.command,
        "halving": halving.command,
        "peers": peers.command,
    },
}
for _group, _commands in _COMMANDS.items():
    for _name, _command in _commands.items():
        app.command(_name, rich_help_panel=_group)(_command)


def _print_version(wanted: bool) -> None:
    if wanted:
        out.print(f"tca-cosim {versions()['tca-cosim']}", highlight=False)
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Version of the program")
    ] = False,
) -> None:
    """Options without a command."""


@app.command("fit", hidden=True, context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
def _renamed(context: typer.Context) -> None:
    """Names the command that `fit` has become."""
    with reported():
        raise CosimError(f"fit is now called select: run `{shlex.join(['tca-cosim', 'select', *context.args])}`")
