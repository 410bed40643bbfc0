"""A whole chart: the reference solution, then the points, then the table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

from ...parallel import Worker, serial
from ...scene import Scene, read
from .measure import measure_points
from .norm import ErrorNorm
from .reference_solution import LEVELS, solve_reference
from .series import OWN, read_series
from .table import chart_table

__all__ = ["ReferenceSolution", "reference_solutions", "run_chart"]


@dataclass(frozen=True)
class ReferenceSolution:
    """Norm of one scene, from its fine reference; floor: error of the coarse reference in that norm."""

    scene: Scene
    norm: ErrorNorm
    floor: float


def reference_solutions(
    sources: Sequence[str],
    overrides: Sequence[str] = (),
    file: Path = OWN,
    worker: Worker = serial,
    progress: Callable[[int, float], None] | None = None,
) -> list[ReferenceSolution]:
    """Solve the references of all scenes.

    Parameters
    ----------
    sources : sequence of str
        Names or files of scenes.
    overrides : sequence of str
        'key=value' for all of them.
    file : Path
        Series, whose table [reference] says how fine the references are.
    worker : Worker
        May spread the solutions over processes.
    progress : callable
        (number of the task, share of it done), where they run in this process.

    Raises
    ------
    CosimError
    """
    chosen = read_series(file)
    scenes = [read(source, overrides) for source in sources]
    times = [np.linspace(0.0, scene.stop_time, chosen.outputs + 1) for scene in scenes]
    pairs = [(*case, chosen.reference[level]) for case in zip(sources, times, strict=True) for level in LEVELS]
    tasks = [
        partial(solve_reference, source, overrides, grid, level, partial(progress, number) if progress else None)
        for number, (source, grid, level) in enumerate(pairs)
    ]
    solved: list[xr.Dataset] = [xr.Dataset()] * len(tasks)
    for number, result in worker(tasks):
        solved[number] = result
    references = []
    for k, (scene, grid) in enumerate(zip(scenes, times, strict=True)):
        coarse, fine = solved[len(LEVELS) * k : len(LEVELS) * (k + 1)]
        norm = ErrorNorm.from_reference(fine, grid)
        references.append(ReferenceSolution(scene, norm, norm.error(coarse)))
    return references


def run_chart(
    source: str,
    overrides: Sequence[str] = (),
    repeats: int = 7,
    limit: float = 3.0,
    panels: Sequence[str] = (),
    file: Path = OWN,
    reference: ReferenceSolution | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> xr.Dataset:
    """Measure a chart.

    Parameters
    ----------
    source : str
        Name or file of the scene.
    overrides : sequence of str
        'key=value' for all points.
    repeats : int
        Rounds of warm runs.
    limit : float
        CPU time of the first run of a point [s]; a point that exceeds it has failed.
    panels : sequence of str
        Keys of the panels to measure; all by default.
    file : Path
        Series.
    reference : ReferenceSolution, optional
        From reference_solutions(); solved first by default.
    progress : callable
        Called with the share done.

    Returns
    -------
    Dataset
        See table.chart_table.

    Raises
    ------
    CosimError
    """
    chosen = read_series(file)
    reference = reference or reference_solutions([source], overrides, file)[0]
    trials = chosen.trials(reference.scene, panels)
    done = 0

    def count() -> None:
        nonlocal done
        done += 1
        progress(done / (len(trials) * (repeats + 1)))

    points = measure_points(source, overrides, trials, reference.norm, repeats, limit, count)
    return chart_table(reference.scene, chosen, points, reference.norm, reference.floor, repeats)
