"""tca-cosim stability: maps of where coupling methods fail."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress

from .. import results, stability
from ..errors import CosimError
from .console import extra, out, reported, written
from .options import Folder, Overrides

__all__ = ["command"]


def command(
    scene: Annotated[str, typer.Argument(help="Name of a scene, a .toml file, or `oscillators`: analytic systems")],
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    points: Annotated[int, typer.Option(min=2, max=200, help="Along each axis")] = 12,
    scheduler: Annotated[str | None, typer.Option(help="Address of a dask scheduler; default: processes here")] = None,
    workers: Annotated[int | None, typer.Option(min=0, help="Processes here; 0: this one, without dask")] = None,
) -> None:
    """Maps where each coupling method fails over macro step and stiffness ratio, with the limits of theory (extra
    `sweep`); writes NAME.stability.nc, .png, .svg."""
    with reported():
        if scene == "oscillators" and override:
            raise CosimError(f"--set {override[0]!r}: the analytic systems have nothing to set; leave it out")
        oscillators = scene == "oscillators"
        study = stability.oscillators.study(points) if oscillators else stability.rod.study(scene, override, points)
        with Progress(*Progress.get_default_columns(), console=out, transient=True) as bar:
            task = bar.add_task(study.name, total=len(study.panels) * points)
            found = stability.sweep(study, _worker(scheduler, workers, lambda: bar.advance(task)))
        results.write(found, folder / f"{study.name}.nc")
        stability.chart.save(stability.chart.draw(found), folder, study.name)
        written(folder / f"{study.name}.nc", ".png", ".svg")


def _worker(scheduler: str | None, workers: int | None, advance: Callable[[], None]) -> stability.Worker:
    if workers == 0 and scheduler is None:
        spread = stability.serial
    else:
        with extra("sweep", ", or add --workers 0"):
            from ..stability import cluster  # dask
        spread = partial(cluster.spread, scheduler=scheduler, workers=workers)

    def watched(rows: Sequence[stability.Row]) -> Iterator[tuple[int, list[stability.Verdict]]]:
        for found in spread(rows):
            yield found
            advance()

    return watched
