"""Arguments that several commands take."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["Against", "Folder", "Overrides", "SceneName"]

SceneName = Annotated[str, typer.Argument(metavar="SCENE", help="Name of a scene (tca-cosim list), .toml or .ssp file")]
Overrides = Annotated[list[str], typer.Option("--set", help="key=value as in a scene: rod.order=2, thermal.V='1 V'")]
Folder = Annotated[Path, typer.Option("--out", help="Folder for what is written")]
Against = Annotated[Path | None, typer.Option(help="A result (.nc) to compare with, at its times")]
