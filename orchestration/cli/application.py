"""The application of typer: all commands with their options."""

from __future__ import annotations

import shlex
from typing import Annotated, Any

import typer

from ..errors import CosimError
from .console import reported, say
from .encoding import require_utf8
from .group import lazy_group

__all__ = ["COMMANDS", "app"]

# Group of the help -> commands -> their modules.
COMMANDS: dict[str, dict[str, str]] = {
    "Simulate": {
        "new": "new",
        "run": "run",
        "realtime": "realtime",
        "list": "scenes",
        "explain": "explain",
        "export": "export",
    },
    "Look at results": {"report": "report", "animate": "animate"},
    "Verify": {"verify": "verify", "monolith": "monolith", "reference": "reference", "paper": "paper"},
    "Study": {
        "sweep": "sweep",
        "select": "select",
        "modes": "modes",
        "linearise": "linearise",
        "stability": "stability",
    },
    "Design": {"plan": "plan", "workspace": "workspace", "identify": "identify"},
    "Benchmark": {
        "timing": "timing",
        "performance": "performance",
        "chart": "chart",
        "halving": "halving",
        "peers": "peers",
    },
}


class _App(typer.Typer):
    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        require_utf8()
        return super().__call__(*args, **kwargs)


app = _App(
    cls=lazy_group(__package__, COMMANDS),
    rich_markup_mode=None,  # what it needs takes longer to load than most commands to run
    no_args_is_help=True,
    add_completion=False,
    help="Co-simulation of soft manipulators driven by twisted-and-coiled actuators (TCAs), and of any FMUs.",
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from ..results import versions

        say(f"tca-cosim {versions()['tca-cosim']}")
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
