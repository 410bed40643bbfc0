"""tca-cosim animate: an animation of a result."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress

from .console import out, reported, written
from .options import Folder, Overrides
from .shown import From, MaybeScene, shown

__all__ = ["command"]


class Kind(str, Enum):
    gif = "gif"
    mp4 = "mp4"
    webm = "webm"


def command(
    scene: MaybeScene = None,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    source: From = None,
    kind: Annotated[
        Kind, typer.Option("--format", help="File format; mp4 and webm require tca-cosim[report]")
    ] = Kind.gif,
    frames: Annotated[int, typer.Option(min=2, help="Largest number of frames, evenly spread in time")] = 100,
    fps: Annotated[float, typer.Option(min=0.1, max=100.0, help="Frames per second")] = 20.0,
) -> None:
    """Draws the manipulator in motion, coloured by temperature; writes NAME.gif, NAME.mp4 or NAME.webm."""
    from ..visualization import animation  # matplotlib

    with reported():
        result = shown(scene, override, source)
        path = folder / f"{result.attrs['scene']}.{kind.value}"
        with Progress(*Progress.get_default_columns(), console=out.console, transient=True) as bar:
            task = bar.add_task("frames", total=frames)
            animation.save(result, path, frames, fps, lambda: bar.advance(task))
        written(path)
