"""The monolith in time: CVODE's BDF (scikit-sundae) with tight tolerances from event to event, new behind each."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import xarray as xr
from sksundae import SUNDIALS_VERSION
from sksundae.cvode import CVODE

from ... import results
from ...cosim.master import StepLog
from ...errors import SubsystemError
from ...fmi.archive import Variable
from ...scene import Scene
from ...scene.loop_closure import closed_inside
from ...simulation import recorded_variables
from .system import Piece, System, assembled

__all__ = ["course", "logged", "result", "run"]

_MOST_STEPS = 1_000_000  # of the integrator, between two outputs
_SAME = 1e-9  # share of a step below which two times are the same


def run(
    scene: Scene,
    tolerance: float = 1e-10,
    times: np.ndarray | None = None,
    progress: Callable[[float], None] = lambda time: None,
) -> xr.Dataset:
    """A Dataset with the names of a co-simulation's (results.collect), where each macro step is an output.

    tolerance: relative, and absolute as a share of the states' nominals. times [s]: of the output, from 0; where not
    given, the macro steps of a fixed control. Raises SceneError, SubsystemError."""
    scene = closed_inside(scene)
    with assembled(scene) as system:
        return result(scene, logged(scene, system, tolerance, times, progress), tolerance)


def logged(
    scene: Scene,
    system: System,
    tolerance: float,
    times: np.ndarray | None = None,
    progress: Callable[[float], None] = lambda time: None,
) -> list[StepLog]:
    """The start and every output of run(), for result()."""
    logs = []
    for point in course(scene, system, tolerance, times):
        logs.append(StepLog(point.time, point.length, 0, 0.0, 0.0, None, system.record()))
        progress(point.time)
    return logs


def result(scene: Scene, logs: Sequence[StepLog], tolerance: float) -> xr.Dataset:
    names: dict[str, Sequence[Variable]] = {m.name: recorded_variables(m) for m in scene.members}
    dataset = results.collect(scene, names, logs[0].record, logs[1:], "complete")
    dataset.attrs["coupling"] = json.dumps(
        {"method": "monolith", "solver": f"CVODE BDF {SUNDIALS_VERSION}", "tolerance": tolerance}
    )
    return dataset


@dataclass(frozen=True)
class Point:
    time: float  # [s]
    length: float  # since the point before [s]
    states: np.ndarray


def course(scene: Scene, system: System, tolerance: float, times: np.ndarray | None = None) -> Iterator[Point]:
    """The points of the output; the system stands at each while it is looked at."""
    pieces = _pieces(scene, times)
    first = (pieces[0][0], pieces[0][-1])
    states = system.start(first[0], first)
    scale = system.nominals()
    system.place(first[0], states, first)
    yield Point(first[0], 0.0, states)
    for grid in pieces:
        piece = (grid[0], grid[-1])
        solver = _solver(system, piece, states, tolerance, scale)
        for before, time in pairwise(grid):
            states = _reached(solver, time) if states.size else states
            system.place(time, states, piece)
            yield Point(time, time - before, states)


def _solver(system: System, piece: Piece, states: np.ndarray, tolerance: float, scale: np.ndarray) -> CVODE:
    def slope(time: float, states: np.ndarray, rates: np.ndarray) -> None:
        system.place(time, states, piece)
        rates[:] = system.rates()

    solver = CVODE(slope, method="BDF", rtol=tolerance, atol=tolerance * scale, max_num_steps=_MOST_STEPS)
    if states.size:
        solver.init_step(piece[0], states)
    return solver


def _reached(solver: CVODE, time: float) -> np.ndarray:
    solution = solver.step(time)
    if not solution.success:
        raise SubsystemError(
            f"monolith: CVODE stopped before t = {time:.6g} s: {solution.message}; loosen the tolerance"
        )
    return np.array(solution.y).reshape(-1)


def _pieces(scene: Scene, times: np.ndarray | None) -> list[np.ndarray]:
    """Output times from event to event; both ends of a piece are in it."""
    stop = scene.stop_time if times is None else float(times[-1])
    breaks = {t for m in scene.members for signal in m.signals.values() for t in signal.breaks if 0.0 < t < stop}
    ends = sorted({0.0, *breaks, stop})
    if times is None:
        step = scene.coupling.macro_step
        counts = [max(1, math.ceil((b - a) / step - _SAME)) for a, b in pairwise(ends)]
        return [np.linspace(a, b, n + 1) for (a, b), n in zip(pairwise(ends), counts, strict=True)]
    inside = [times[(times > a + _SAME * (b - a)) & (times < b - _SAME * (b - a))] for a, b in pairwise(ends)]
    return [np.array([a, *middle, b]) for (a, b), middle in zip(pairwise(ends), inside, strict=True)]
