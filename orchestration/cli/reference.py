"""tca-cosim reference: an independent solution without the FMUs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .. import results
from ..scene import read
from .console import extra, reported, say_times, show_gaps, written
from .options import Against, Folder, Overrides, SceneName

__all__ = ["command"]


def command(
    scene: SceneName,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    refined: Annotated[bool, typer.Option(help="Refinement in space and time, to check the reference itself")] = False,
    against: Against = None,
) -> None:
    """Solves a scene independently of the FMUs (requires tca-cosim[reference]); writes NAME.reference.nc."""
    with reported():
        with extra("reference"):
            from ..verification import reference  # scikit-fem
        described = read(scene, override)
        other = results.read(against) if against else None
        resolution = reference.Resolution().refined() if refined else reference.Resolution()
        solved = reference.run(described, resolution, None if other is None else other["time"].to_numpy())
        results.write(solved, folder / f"{described.name}.reference.nc")
        written(folder / f"{described.name}.reference.nc")
        if other is not None:
            say_times(described, other)
            show_gaps(other, solved)
