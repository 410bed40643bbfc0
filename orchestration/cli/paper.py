"""tca-cosim paper: Fig. 3."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from ..scene import read
from ..verification import paper
from .console import out, reported, run, written
from .options import Folder

__all__ = ["command"]


def command(folder: Folder = Path("results")) -> None:
    """Runs the paper's three scenes; draws its Fig. 3 with the values read off the paper; prints how far apart they
    are."""
    from ..verification.paper import figure  # matplotlib takes long to load

    with reported():
        scenes = {name: read(name) for name in paper.SCENES}
        computed = {name: run(scene) for name, scene in scenes.items()}
        heads = ("scene", "rms temperature [K]", "rms angle [rad]", "mean sweeps per macro step")
        table = Table(*heads, title="computed, against read off the paper")
        for name, result in computed.items():
            temperature, angle = paper.deviations(result, name)
            table.add_row(
                name, f"{temperature:.3f}", f"{angle:.4f}", f"{float(result['coupling.sweeps'][1:].mean()):.2f}"
            )
        out.print(table)
        written(*figure.save(figure.draw(scenes, computed), folder))
