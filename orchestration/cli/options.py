"""Arguments and options of several commands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["Against", "Folder", "Overrides", "SceneName"]

SceneName = Annotated[
    str, typer.Argument(metavar="SCENE", help="Name of a scene (tca-cosim list), or a .toml or .ssp file")
]
Overrides = Annotated[
    list[str],
    typer.Option(
        "--set", help="Key and value that win over the scene, quoted for the shell: 'rod.order=2', 'thermal.V[2]=1 V'"
    ),
]
Folder = Annotated[Path, typer.Option("--out", help="Folder of the files written")]
Against = Annotated[Path | None, typer.Option(help="Result (.nc) to compare with, at its times and up to its end")]
