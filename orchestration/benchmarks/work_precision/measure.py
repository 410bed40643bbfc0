"""A chart, measured: every point's error once, its time again and again in turn with all others."""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

from threadpoolctl import threadpool_limits

from ...errors import CosimError
from .norm import Norm
from .series import Trial
from .solvers import SOLVERS, LateError, Solver

__all__ = ["SLOW", "Measured", "measure"]

SLOW = 2.0  # s of CPU; what takes longer is repeated FEW times only
FEW = 2
WRONG = 1.0  # error above which a run has failed, whatever it says


@dataclass
class Measured:
    """error: share of the ranges; cold: s of CPU from the scene's file to the end of the first run; warm: s of CPU of
    each later run; work: see Solver; reason: why it failed, else empty."""

    trial: Trial
    error: float = math.nan
    cold: float = math.nan
    warm: list[float] = field(default_factory=list)
    work: float = math.nan
    reason: str = ""


def measure(
    source: str,
    overrides: Sequence[str],
    trials: Sequence[Trial],
    norm: Norm,
    repeats: int = 7,
    limit: float = 20.0,
    progress: Callable[[], None] = lambda: None,
) -> list[Measured]:
    """One thread throughout. The first run of a point is cold and not among `warm`; then come `repeats` rounds, each of
    all points in turn, so that what disturbs the machine disturbs all alike. limit [s] of CPU for a first run, as
    Solver.run has it. progress: called after each point of each round."""
    with threadpool_limits(1):
        points, live = [Measured(trial) for trial in trials], {}
        for k, point in enumerate(points):
            solver = _first(source, overrides, point, norm, limit)
            if solver:
                live[k] = solver
            progress()
        for turn in range(repeats):
            gc.collect()
            for k, solver in live.items():
                if not points[k].warm or points[k].warm[0] < SLOW or turn < FEW:
                    solver.ready()
                    points[k].warm.append(_clocked(partial(solver.run, math.inf)))
                progress()
        for solver in live.values():
            solver.close()
    return points


def _first(source: str, overrides: Sequence[str], point: Measured, norm: Norm, limit: float) -> Solver | None:
    """Fills in what the first run tells; the solver to go on with, unless it failed."""
    trial, solver = point.trial, None
    begin = time.process_time()
    try:
        solver = SOLVERS[trial.solver](source, [*overrides, *trial.overrides], norm.times, **trial.settings)
        solver.run(limit)
        point.cold = time.process_time() - begin
        point.error = norm.error(solver.result())
        point.work = solver.work
        if not point.error <= WRONG:
            point.reason = f"error {point.error:.2g} of the range"
    except (CosimError, LateError) as error:
        point.cold = time.process_time() - begin
        point.reason = str(error)
    if point.reason:
        point.error = math.inf
        if solver:
            solver.close()
        return None
    return solver


def _clocked(run: Callable[[], None]) -> float:
    """s of CPU; garbage is collected between the rounds, not meanwhile."""
    gc.disable()
    try:
        begin = time.process_time()
        run()
        return time.process_time() - begin
    finally:
        gc.enable()
