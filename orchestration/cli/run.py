"""tca-cosim run: run a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import Folder, Overrides, SceneName
from .running import run_scene

__all__ = ["command"]


def command(
    scene: SceneName,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    name: Annotated[str | None, typer.Option("--name", help="Name of the files; default: that of the scene")] = None,
) -> None:
    """Runs a scene; writes NAME.nc and NAME.csv.

    A result of other settings that has the name is kept as NAME.previous.
    """
    run_scene(scene, override, folder, name)
