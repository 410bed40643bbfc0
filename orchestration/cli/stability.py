"""tca-cosim stability: stability maps of coupling methods."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress

from .. import results
from ..errors import CosimError
from ..files import save_figure
from ..scene.manipulator import ROD
from .console import out, reported, written
from .options import Folder, Overrides
from .shown import require_models
from .workers import Scheduler, Workers, worker

__all__ = ["command"]


def command(
    scene: Annotated[str, typer.Argument(help="Name or file of a scene, or `oscillators` for analytic systems")],
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    points: Annotated[int, typer.Option(min=2, max=200, help="Points along each axis")] = 12,
    scheduler: Scheduler = None,
    workers: Workers = None,
) -> None:
    """Maps where each coupling method fails over macro step and stiffness ratio, with the limits of theory.

    Requires tca-cosim[sweep]; writes NAME.stability.nc, .png, .svg.
    """
    from ..studies import stability  # its theory and pictures take long to load

    with reported():
        if scene == "oscillators" and override:
            raise CosimError(f"--set {override[0]!r}: the analytic systems have no settings; leave --set out")
        oscillators = scene == "oscillators"
        if not oscillators:
            require_models("stability", scene, override, (ROD,))
        study = stability.oscillator_study(points) if oscillators else stability.rod_study(scene, override, points)
        with Progress(*Progress.get_default_columns(), console=out.console, transient=True) as bar:
            task = bar.add_task(study.name, total=len(study.panels) * points)
            dataset = stability.run_study(study, worker(scheduler, workers, lambda _: bar.advance(task)))
        results.write(dataset, folder / f"{study.name}.nc")
        save_figure(stability.chart.draw(dataset), folder, study.name)
        written(folder / f"{study.name}.nc", ".png", ".svg")
