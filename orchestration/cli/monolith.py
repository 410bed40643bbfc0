"""tca-cosim monolith: all FMUs as one system."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .. import results
from ..scene import read
from .console import reported, say_times, show_gaps, watched, written
from .options import Against, Folder, Overrides, SceneName

__all__ = ["command"]


def command(
    scene: SceneName,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    tolerance: Annotated[float, typer.Option(min=1e-13, max=1e-3, help="Relative tolerance of the integrator")] = 1e-10,
    against: Against = None,
) -> None:
    """Solves the FMUs of a scene by model exchange as one system with one integrator; writes NAME.monolith.nc."""
    from ..verification import monolith  # its solver takes long to load

    with reported():
        described = read(scene, override)
        other = results.read(against) if against else None
        times = None if other is None else other["time"].to_numpy()
        solved = watched(described, lambda progress: monolith.solve_monolith(described, tolerance, times, progress))
        results.write(solved, folder / f"{described.name}.monolith.nc")
        written(folder / f"{described.name}.monolith.nc")
        if other is not None:
            say_times(described, other)
            show_gaps(other, solved)
