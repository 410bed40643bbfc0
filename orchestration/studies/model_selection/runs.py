"""Runs of a scene with different choices: each is made once and only as far as needed; results and costs are kept."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from ...cosim.master import StepLog
from ...cosim.step_logs import StepLogs
from ...errors import CosimError
from ...results import ResultTable
from ...scene import Scene
from ...simulation import OpenSimulation, open_simulation, recorded_variables
from .hierarchy import Choice, apply_choice
from .measure import Quantity, Trajectory, relative_error, requested_quantities

__all__ = ["ResumableRun", "RunCache"]

_SAME_TIME = 1e-9  # share of a time within which two times are equal


class ResumableRun:
    """A run that can stop early and go on later.

    Attributes
    ----------
    scene : Scene
        What is run.
    cost : float
        CPU time so far, without loading [s].
    """

    def __init__(self, scene: Scene, watch: Callable[[float], None] = lambda time: None) -> None:
        """Prepare a run; watch is called with the time [s] after every macro step."""
        self.scene = scene
        self._watch = watch
        self.cost = 0.0
        self._logs = StepLogs()
        self._ready: OpenSimulation | None = None
        self._parts: Iterator[Sequence[StepLog]] | None = None
        self._failure: CosimError | None = None
        self._open = contextlib.ExitStack()

    def advance_to(self, stop: float, limit: float = math.inf) -> bool:
        """Go on to `stop` [s]; whether it got there before its cost exceeded `limit` [s].

        Raises the error with which it ended before.
        """
        if self._passed(stop):
            return True
        if self._failure is not None:
            raise self._failure
        try:
            return self._advance(stop, limit)
        except CosimError as failure:
            failure.partial = self._collected(f"partial: {failure}") if self._parts else None
            self._failure = failure
            raise

    @property
    def result(self) -> ResultTable:
        """The result of everything run so far."""
        return self._collected("complete")

    def trajectory(self, quantities: Mapping[str, Quantity], stop: float) -> Trajectory:
        """Values of the quantities until `stop` [s]."""
        times = np.concatenate([[0.0], self._logs.column("time")])
        within = int(np.searchsorted(times, stop * (1.0 + _SAME_TIME), side="right"))
        values = {}
        for name, quantity in quantities.items():
            columns = {v.name: k for k, v in enumerate(recorded_variables(self.scene.member(quantity.member)))}
            chosen = [columns[element] for element in quantity.elements]
            rows = self._logs.record(quantity.member, self._first[quantity.member])
            values[name] = rows[:within, chosen]
        return Trajectory(times[:within], values)

    @property
    def ended(self) -> bool:
        """Whether it reached its stop time or failed."""
        return self._failure is not None or self._passed(self.scene.stop_time)

    def close(self) -> None:
        """Free its FMUs. Results stay; it goes no further."""
        self._open.close()

    def _passed(self, stop: float) -> bool:
        return len(self._logs) > 0 and self._logs[-1].time >= stop * (1.0 - _SAME_TIME)

    def _advance(self, stop: float, limit: float) -> bool:
        if self._parts is None:
            self._ready = self._open.enter_context(open_simulation(self.scene))
            self._first, self._parts = self._ready.master.observe(), self._ready.parts(self._watch)
        before, begin = self.cost, time.thread_time()
        for part in self._parts:
            self._logs.add(part)
            self.cost = before + time.thread_time() - begin
            if self._passed(stop) or self.cost > limit:
                break
        return self._passed(stop)

    def _collected(self, status: str) -> ResultTable:
        assert self._ready is not None, "nothing was run"
        return self._ready.collect(self._first, self._logs, status)


class RunCache:
    """Runs of one scene by choice.

    Attributes
    ----------
    scene : Scene
        The scene whose levels are chosen.
    quantities : dict of str to Quantity
        What it asks for.
    count : int
        Number of runs made.
    """

    def __init__(
        self,
        scene: Scene,
        announce: Callable[[Choice], None] = lambda choice: None,
        watch: Callable[[float], None] = lambda time: None,
    ) -> None:
        """Open an empty cache; announce is called with every choice before its run, watch after every macro step."""
        self.scene = scene
        self.quantities = requested_quantities(scene)
        self.count = 0
        self._announce, self._watch = announce, watch
        self._runs: dict[tuple[tuple[str, int], ...], ResumableRun] = {}

    def __call__(self, choice: Choice, stop: float) -> ResumableRun:
        """The run with that choice, at least until `stop` [s]. Raises the error with which it ended before."""
        key = tuple(sorted(choice.items()))
        if key not in self._runs:
            self._announce(choice)
            self.count += 1
            self._runs[key] = ResumableRun(apply_choice(self.scene, choice), self._watch)
        self._runs[key].advance_to(stop)
        return self._runs[key]

    def difference(self, choice: Choice, finer: Choice, stop: float) -> float:
        """Error of `choice` relative to `finer` until `stop` [s], share of the range; inf where `choice` fails."""
        reference = self(finer, stop).trajectory(self.quantities, stop)
        try:
            error = relative_error(self(choice, stop).trajectory(self.quantities, stop), reference, self.quantities)
        except CosimError:
            return math.inf
        return error if math.isfinite(error) else math.inf

    def close(self) -> None:
        """Free all FMUs. Results stay; runs that had not come to their end are dropped."""
        for run in self._runs.values():
            run.close()
        self._runs = {key: run for key, run in self._runs.items() if run.ended}
