"""Measurement of a chart: the error of every point once, its CPU time repeatedly, in turn with all other points."""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

from threadpoolctl import threadpool_limits

from ...errors import CosimError
from .norm import ErrorNorm
from .series import Trial
from .solvers import SOLVERS, Solver, TimeLimitError

__all__ = ["SLOW", "MeasuredPoint", "measure_points"]

SLOW = 2.0  # [s] of CPU; runs that take longer are repeated FEW times only
FEW = 2
WRONG = 1.0  # error, share of the range, above which a run has failed even if it came to its end


@dataclass
class MeasuredPoint:
    """Measurements of one point of a chart.

    Attributes
    ----------
    trial : Trial
        Solver and settings.
    error : float
        Share of the ranges; inf where it failed.
    cold : float
        CPU time from the scene's file to the end of the first run [s].
    warm : list of float
        CPU time of each later run [s].
    work : float
        Evaluations, see Solver.
    reason : str
        Why it failed; empty where it did not.
    """

    trial: Trial
    error: float = math.nan
    cold: float = math.nan
    warm: list[float] = field(default_factory=list)
    work: float = math.nan
    reason: str = ""


def measure_points(
    source: str,
    overrides: Sequence[str],
    trials: Sequence[Trial],
    norm: ErrorNorm,
    repeats: int = 7,
    limit: float = 20.0,
    progress: Callable[[], None] = lambda: None,
) -> list[MeasuredPoint]:
    """Measure all points in one thread.

    The first run of a point is cold and not among `warm`; then come `repeats` rounds, each of all points in turn, so
    that a disturbance of the machine affects all alike. limit: CPU time of a first run [s], as in Solver.run; progress:
    called after each point of each round.
    """
    with threadpool_limits(1):
        points, live = [MeasuredPoint(trial) for trial in trials], {}
        for k, point in enumerate(points):
            solver = _first(source, overrides, point, norm, limit)
            if solver:
                live[k] = solver
            progress()
        for turn in range(repeats):
            gc.collect()
            for k, solver in live.items():
                if not points[k].warm or points[k].warm[0] < SLOW or turn < FEW:
                    solver.rewind()
                    points[k].warm.append(_clocked(partial(solver.run, math.inf)))
                progress()
        for solver in live.values():
            solver.close()
    return points


def _first(source: str, overrides: Sequence[str], point: MeasuredPoint, norm: ErrorNorm, limit: float) -> Solver | None:
    """Make the first run and note its error; the solver to go on with, None where it failed."""
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
    except (CosimError, TimeLimitError) as error:
        point.cold = time.process_time() - begin
        point.reason = str(error)
    if point.reason:
        point.error = math.inf
        if solver:
            solver.close()
        return None
    return solver


def _clocked(run: Callable[[], None]) -> float:
    """CPU time of a call [s]; garbage is collected between the rounds, not during a run."""
    gc.disable()
    try:
        begin = time.process_time()
        run()
        return time.process_time() - begin
    finally:
        gc.enable()
