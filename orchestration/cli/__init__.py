"""The command line: one file here per command. An error a user can mend is one message and exit code 2."""

from __future__ import annotations

from collections.abc import Callable

import typer

from . import (
    animate,
    chart,
    export,
    fit,
    halving,
    modes,
    monolith,
    paper,
    peers,
    reference,
    report,
    run,
    scenes,
    stability,
    sweep,
    timing,
)

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
    "fit": fit.command,
    "report": report.command,
    "animate": animate.command,
    "chart": chart.command,
    "halving": halving.command,
    "peers": peers.command,
}
for name, command in _COMMANDS.items():
    app.command(name)(command)
