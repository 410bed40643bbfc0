"""Integration of the monolith in time: CVODE's BDF (scikit-sundae) with tight tolerances, restarted at every event.

Breaks of signals and time events of FMUs are hit exactly; state events are located by CVODE's root finding on the event
indicators.
"""

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
from .system import Interval, System, assembled

__all__ = ["Point", "integrate", "monolith_result", "solve_monolith", "trajectory"]

_MOST_STEPS = 1_000_000  # of the integrator, between two outputs: a bound on the time of a stiff or wild system
_MOST_EVENTS = 10_000  # between two outputs, above which events are taken to accumulate (Zeno)
_MOST_WILD = 100  # evaluations without finite rates, which shorter steps may avoid, before a run is given up
_CLOSE = 1e-7  # share of the time between two outputs: events that follow each other faster are close
_MOST_CLOSE = 5  # close events in a row, after which events are taken to accumulate
_SAME = 1e-9  # share of a step below which two times are the same


def solve_monolith(
    scene: Scene,
    tolerance: float = 1e-10,
    times: np.ndarray | None = None,
    progress: Callable[[float], None] = lambda time: None,
) -> xr.Dataset:
    """Solve a scene as one system.

    Parameters
    ----------
    scene : Scene
        The scene; its FMUs are needed as model exchange, quasi-static ones as co-simulation.
    tolerance : float
        Relative, and absolute as a share of the states' nominals.
    times : ndarray (n,), optional
        Times of the output [s], from the start on; by default the macro steps of a fixed control.
    progress : callable
        Called with the time [s] of every output.

    Returns
    -------
    Dataset
        With the names of a co-simulation's (results.collect), where each macro step is an output.

    Raises
    ------
    SceneError, SubsystemError
        For loops without a solver, FMUs that lack an interface, and events that accumulate.
    """
    scene = closed_inside(scene)
    with assembled(scene) as system:
        return monolith_result(scene, integrate(scene, system, tolerance, times, progress), tolerance)


def integrate(
    scene: Scene,
    system: System,
    tolerance: float,
    times: np.ndarray | None = None,
    progress: Callable[[float], None] = lambda time: None,
) -> list[StepLog]:
    """The log of the start and of every output, for monolith_result(). Arguments as of solve_monolith()."""
    logs = []
    for point in trajectory(scene, system, tolerance, times):
        logs.append(StepLog(point.time, point.length, 0, 0.0, 0.0, None, system.record()))
        progress(point.time)
    return logs


def monolith_result(scene: Scene, logs: Sequence[StepLog], tolerance: float) -> xr.Dataset:
    """The Dataset of an integration."""
    names: dict[str, Sequence[Variable]] = {m.name: recorded_variables(m) for m in scene.members}
    dataset = results.collect(scene, names, logs[0].record, logs[1:], "complete").to_xarray()
    dataset.attrs["coupling"] = json.dumps(
        {"method": "monolith", "solver": f"CVODE BDF {SUNDIALS_VERSION}", "tolerance": tolerance}
    )
    return dataset


@dataclass(frozen=True)
class Point:
    """An output: time [s], length since the one before [s], states (n,)."""

    time: float
    length: float
    states: np.ndarray


def trajectory(scene: Scene, system: System, tolerance: float, times: np.ndarray | None = None) -> Iterator[Point]:
    """The outputs one by one; the system stands at each while it is looked at.

    Ends early, after the output at the event, where an FMU wishes to end.
    """
    grids = _grids(scene, times)
    first = (grids[0][0], grids[0][-1])
    states = system.start(first[0], first)
    scale = system.nominals()
    system.set_state(first[0], states, first)
    yield Point(first[0], 0.0, states)
    for number, grid in enumerate(grids):
        interval = (grid[0], grid[-1])
        ending = ""
        if number and _has_events(
            system
        ):  # the signals may have jumped, which is an event to FMUs with discrete states
            states, ending = system.handle_event(interval[0], states, interval)
        run = _Integration(system, interval, states, tolerance, scale)
        for before, time in pairwise(grid):
            if not ending:
                states, ending = run.advance(before, time)
            if ending:
                reached = run.time if run.time > before else time
                system.set_state(reached, states, interval)
                yield Point(reached, reached - before, states)
                return
            system.set_state(time, states, interval)
            yield Point(time, time - before, states)


def _has_events(system: System) -> bool:
    return bool(system.indicator_count) or system.next_event < math.inf


class _Integration:
    """CVODE over one interval between breaks of the signals, restarted behind each event of an FMU."""

    def __init__(
        self, system: System, interval: Interval, states: np.ndarray, tolerance: float, scale: np.ndarray
    ) -> None:
        self.time = interval[0]
        self._ending = ""  # name of the part that wishes to end
        self._wild = 0  # evaluations of rates that were not finite
        self._system, self._interval, self._states = system, interval, states
        self._tolerance, self._scale = tolerance, scale
        self._start(self.time)

    def advance(self, before: float, time: float) -> tuple[np.ndarray, str]:
        """Go on to `time` [s]; the states (n,) there or where a part wishes to end, and the name of that part."""
        last, close = -math.inf, 0
        for _ in range(_MOST_EVENTS):
            target = min(time, max(self._system.next_event, self.time))
            event = self._integrate(target)
            if self._ending:
                return self._states, self._ending
            due = self._system.next_event <= self.time
            if event or due:
                close = close + 1 if self.time - last < _CLOSE * (time - before) else 0
                last = self.time
                if close >= _MOST_CLOSE:
                    break
                self._states, self._ending = self._system.handle_event(self.time, self._states, self._interval)
                if self._ending:
                    return self._states, self._ending
                self._start(self.time)
            if self.time >= time:
                return self._states, ""
        raise SubsystemError(
            f"monolith: events of {', '.join(self._system.parts)} accumulate at t = {self.time:.9g} s; end the run "
            "before, or model what happens there without ever shorter bounces"
        )

    def _start(self, time: float) -> None:
        """Initialise the solver at the present states. One without states gets a dummy where events must be found."""
        system, count = self._system, self._system.indicator_count
        self._dummy = not self._states.size
        if self._dummy and not count:
            return
        options: dict[str, object] = {}
        if count:

            def events(t: float, y: np.ndarray, z: np.ndarray) -> None:
                system.set_state(t, y[: self._states.size], self._interval)
                z[:] = system.indicators()

            options = {"eventsfn": events, "num_events": count}

        def slope(t: float, y: np.ndarray, rates: np.ndarray) -> None:
            if self._dummy:
                rates[:] = 0.0
                return
            system.set_state(t, y, self._interval)
            rates[:] = system.rates()
            self._refuse_wild(t, rates)

        scale = np.ones(1) if self._dummy else self._tolerance * self._scale
        self._solver = CVODE(
            slope, method="BDF", rtol=self._tolerance, atol=scale, max_num_steps=_MOST_STEPS, **options
        )
        self._solver.init_step(time, np.zeros(1) if self._dummy else self._states)

    def _refuse_wild(self, time: float, rates: np.ndarray) -> None:
        """Raise SubsystemError where rates stay without finite values though CVODE shortens its steps."""
        if np.isfinite(rates).all():
            return
        self._wild += 1
        if self._wild > _MOST_WILD:
            raise SubsystemError(
                f"monolith: the derivatives of {', '.join(self._system.parts)} are not finite from t = {time:.9g} s "
                "on; end the run before, or mend the FMU"
            )

    def _integrate(self, target: float) -> bool:
        """Go on to `target` [s], or to a state or step event before it; whether there is one."""
        system = self._system
        if target <= self.time:
            return False
        if self._dummy and not system.indicator_count:
            self.time = target
            return False
        if not _has_events(system):
            self._take(self._solver.step(target), target)
            system.set_state(self.time, self._states, self._interval)
            needed, self._ending = system.completed_step()
            return needed
        while self.time < target:
            solution = self._solver.step(target, method="onestep", tstop=target)
            root = bool(getattr(solution, "i_events", None) is not None and np.any(solution.i_events))
            self._take(solution, float(np.ravel(solution.t)[-1]))
            if abs(target - self.time) <= 1e-14 * max(abs(target), 1.0):
                self.time = target
            if root:
                return True
            system.set_state(self.time, self._states, self._interval)
            needed, self._ending = system.completed_step()
            if needed or self._ending:
                return needed
        return False

    def _take(self, solution: object, time: float) -> None:
        if not solution.success:  # type: ignore[attr-defined]
            raise SubsystemError(
                f"monolith: CVODE stopped before t = {time:.6g} s: {solution.message}; loosen the tolerance"  # type: ignore[attr-defined]
            )
        self.time = time
        if not self._dummy:
            states = np.array(solution.y)  # type: ignore[attr-defined]
            self._states = states.reshape(-1, self._states.size)[-1] if states.ndim > 1 else states.reshape(-1)


def _grids(scene: Scene, times: np.ndarray | None) -> list[np.ndarray]:
    """Output times between the breaks of the signals; both ends of an interval are in it."""
    start = scene.start_time if times is None else float(times[0])
    stop = scene.stop_time if times is None else float(times[-1])
    breaks = {t for m in scene.members for signal in m.signals.values() for t in signal.breaks if start < t < stop}
    ends = sorted({start, *breaks, stop})
    if times is None:
        step = scene.coupling.macro_step
        counts = [max(1, math.ceil((b - a) / step - _SAME)) for a, b in pairwise(ends)]
        return [np.linspace(a, b, n + 1) for (a, b), n in zip(pairwise(ends), counts, strict=True)]
    inside = [times[(times > a + _SAME * (b - a)) & (times < b - _SAME * (b - a))] for a, b in pairwise(ends)]
    return [np.array([a, *middle, b]) for (a, b), middle in zip(pairwise(ends), inside, strict=True)]
