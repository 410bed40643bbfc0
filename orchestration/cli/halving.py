"""tca-cosim halving: the coupling error over the macro step."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.progress import Progress, TaskID
from rich.table import Table

from ..scene.manipulator import ROD
from .console import extra, out, reported, written
from .options import Folder, Overrides
from .shown import require_models

__all__ = ["command"]

SHOWN = ("step", "difference", "order")


def command(
    scenes: Annotated[list[str], typer.Argument(metavar="SCENE...", help="Names or files of scenes")],
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    halvings: Annotated[
        int, typer.Option(min=1, max=16, help="Largest number of halvings; the study ends at 1e-9 of the range")
    ] = 12,
) -> None:
    """Compares the co-simulation with the monolith of the same models as macro steps are halved.

    Requires tca-cosim[chart]; writes halving_NAME.nc.
    """
    with reported():
        with extra("chart"):
            from .. import results
            from ..benchmarks import work_precision
        paths: list[Path] = []
        shown = Table("scene", "macro step [s]", "difference, share of the range", "order")
        with Progress(*Progress.get_default_columns(), console=out.console, transient=True) as bar:
            for name in scenes:
                require_models("halving", name, override, (ROD,))
                task = bar.add_task(name, total=1.0)

                def progress(share: float, task: TaskID = task) -> None:
                    bar.update(task, completed=share)

                halved = work_precision.halve_steps(name, override, halvings, progress)
                paths.append(folder / f"halving_{halved.attrs['scene']}.nc")
                results.write(halved, paths[-1])
                for step, difference, slope in zip(*(halved[key].to_numpy() for key in SHOWN), strict=True):
                    off = "failed" if np.isnan(difference) else f"{difference:.2e}"
                    order = "-" if np.isnan(slope) else f"{slope:.2f}"  # the first has none before it
                    shown.add_row(halved.attrs["scene"], f"{step:.6g}", off, order)
                shown.add_section()
        out.print(shown)
        written(*paths)
