"""tca-cosim modes: natural frequencies."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.table import Table

from ..scene import read
from .console import out, reported
from .options import Overrides, SceneName

__all__ = ["command"]


def command(
    scene: SceneName,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    at: Annotated[float, typer.Option("--time", min=0.0, help="Time of the linearisation [s]")] = 0.0,
    count: Annotated[int, typer.Option(min=1, help="Number of modes shown, from the lowest frequency on")] = 10,
) -> None:
    """Computes natural frequencies and damping ratios of small motions about the state of a scene."""
    from ..verification import monolith  # its solver takes long to load

    with reported():
        modes = monolith.natural_modes(read(scene, override), at)
        table = Table("mode", "frequency [Hz]", "damping ratio")
        for k, mode in enumerate(modes.modes[:count], 1):
            table.add_row(str(k), f"{mode.frequency:.6g}", f"{mode.damping:.3g}")
        out.print(table)
        out.print(f"{modes.states} states; fastest growth {modes.growing:.3g} 1/s", highlight=False)
        for remark in modes.remarks:
            out.print(f"note: {remark}", highlight=False, soft_wrap=True)
