"""tca-cosim paper: Fig. 3 of the paper."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from ..scene import read
from ..verification import paper
from .console import out, reported, run, written
from .options import Folder

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["command"]


def command(folder: Folder = Path("results")) -> None:
    """Runs the paper's three scenes, draws its Fig. 3 with the values read off the paper and prints the deviations."""
    from ..verification.paper import figure  # matplotlib takes long to load

    with reported():
        scenes = {name: read(name) for name in paper.SCENES}
        computed = {name: run(scene) for name, scene in scenes.items()}
        out.print(_curves(computed))
        out.print(_tips(computed))
        written(*figure.save(figure.draw(computed), folder))


def _curves(computed: dict[str, xr.Dataset]) -> Table:
    heads = ("scene", "rms temperature [K]", "rms angle [rad]", "mean sweeps per macro step")
    table = Table(*heads, title="curves: computed, against read off the paper")
    for name, result in computed.items():
        rms, sweeps = paper.deviations(result, name), float(result["coupling.sweeps"][1:].mean())
        table.add_row(name, f"{rms.temperature:.3f}", f"{rms.angle:.4f}", f"{sweeps:.2f}")
    return table


def _tips(computed: dict[str, xr.Dataset]) -> Table:
    heads = ("scene", "t [s]", "distance [mm]", "with the paper's angles [mm]", "elongation, computed", "paper")
    caption = "paper: the elongation of a 40 mm body that the paper's tip and angles imply together"
    table = Table(*heads, title="tip in the top view: computed, against read off the paper (±0.5 mm)", caption=caption)
    for name, result in computed.items():
        for tip in paper.compare_tips(result, name):
            distances = f"{tip.distance:.2f}", f"{tip.distance_from_angles:.2f}"
            table.add_row(name, f"{tip.read.time:g}", *distances, f"{tip.elongation:.1%}", f"{tip.elongation_read:.1%}")
    return table
