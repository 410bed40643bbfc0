"""A whole chart: the truth, then the points, then the table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

from ...parallel import Worker, serial
from ...scene import Scene, read
from .measure import measure
from .norm import Norm
from .series import OWN, plan
from .table import tabulated
from .truth import LEVELS, solve

__all__ = ["Truth", "run", "truth"]


@dataclass(frozen=True)
class Truth:
    """Of one scene; floor: the error of the coarse solution in the norm of the fine one."""

    scene: Scene
    norm: Norm
    floor: float


def truth(
    sources: Sequence[str],
    overrides: Sequence[str] = (),
    file: Path = OWN,
    worker: Worker = serial,
    progress: Callable[[int, float], None] | None = None,
) -> list[Truth]:
    """For every scene; file: of the series; the worker may spread them over processes. progress(number of the task,
    share of it done): where they run in this one. Raises CosimError."""
    chosen = plan(file)
    scenes = [read(source, overrides) for source in sources]
    times = [np.linspace(0.0, scene.stop_time, chosen.outputs + 1) for scene in scenes]
    pairs = [(*of, chosen.truth[level]) for of in zip(sources, times, strict=True) for level in LEVELS]
    tasks = [
        partial(solve, source, overrides, grid, level, partial(progress, number) if progress else None)
        for number, (source, grid, level) in enumerate(pairs)
    ]
    solved: list[xr.Dataset] = [xr.Dataset()] * len(tasks)
    for number, result in worker(tasks):
        solved[number] = result
    found = []
    for k, (scene, grid) in enumerate(zip(scenes, times, strict=True)):
        coarse, fine = solved[len(LEVELS) * k : len(LEVELS) * (k + 1)]
        norm = Norm.of(fine, grid)
        found.append(Truth(scene, norm, norm.error(coarse)))
    return found


def run(
    source: str,
    overrides: Sequence[str] = (),
    repeats: int = 7,
    limit: float = 3.0,
    panels: Sequence[str] = (),
    file: Path = OWN,
    known: Truth | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> xr.Dataset:
    """The table (table.tabulated). limit [s] of CPU for the first run of a point; panels: some only; file: of the
    series; known: from truth(), else it is found first; progress(share done). Raises CosimError."""
    chosen = plan(file)
    known = known or truth([source], overrides, file)[0]
    trials = chosen.of(known.scene, panels)
    done = np.zeros(())

    def count() -> None:
        done[...] += 1
        progress(float(done) / (len(trials) * (repeats + 1)))

    points = measure(source, overrides, trials, known.norm, repeats, limit, count)
    return tabulated(known.scene, chosen, points, known.norm, known.floor, repeats)
