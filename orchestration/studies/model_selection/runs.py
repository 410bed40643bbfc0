"""Runs of a scene with one choice after the other, each made once, and only as far as it was asked for: what it gave,
and what it cost."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Mapping

import numpy as np
import xarray as xr

from ... import results
from ...cosim.master import StepLog
from ...errors import CosimError
from ...scene import Scene
from ...simulation import open_simulation, recorded_variables
from .hierarchy import Choice, applied
from .measure import Course, Quantity, error, quantities

__all__ = ["Run", "Runs"]

_SAME = 1e-9  # share of a time within which two are the same


class Run:
    """cost: CPU time after loading [s]. watch: told the time [s] of every macro step."""

    def __init__(self, scene: Scene, watch: Callable[[float], None] = lambda time: None) -> None:
        self.scene = scene
        self._watch = watch
        self.cost = 0.0
        self._logs: list[StepLog] = []
        self._steps: Iterator[StepLog] | None = None
        self._failure: CosimError | None = None
        self._open = contextlib.ExitStack()

    def reach(self, stop: float, limit: float = math.inf) -> bool:
        """On to `stop` [s], no step anew; whether it got there before it cost more than `limit` [s]. Raises the error
        with which it ended before."""
        if self._beyond(stop):
            return True
        if self._failure is not None:
            raise self._failure
        try:
            return self._go(stop, limit)
        except CosimError as failure:
            failure.partial = self._collected(f"partial: {failure}") if self._steps else None
            self._failure = failure
            raise

    @property
    def result(self) -> xr.Dataset:
        """Of all that it has been run."""
        return self._collected("complete")

    def course(self, asked: Mapping[str, Quantity], stop: float) -> Course:
        """Of the quantities asked for, until `stop` [s]."""
        rows = [self._first, *(log.record for log in self._logs if log.time <= stop * (1.0 + _SAME))]
        times = np.array([0.0, *(log.time for log in self._logs[: len(rows) - 1])])
        values = {}
        for name, quantity in asked.items():
            places = {v.name: k for k, v in enumerate(recorded_variables(self.scene.member(quantity.member)))}
            columns = [places[element] for element in quantity.elements]
            values[name] = np.array([row[quantity.member][columns] for row in rows])
        return Course(times, values)

    @property
    def ended(self) -> bool:
        """At its stop time, or by an error."""
        return self._failure is not None or self._beyond(self.scene.stop_time)

    def close(self) -> None:
        """Frees its FMUs. What it has computed stays; it goes no further."""
        self._open.close()

    def _beyond(self, stop: float) -> bool:
        return bool(self._logs) and self._logs[-1].time >= stop * (1.0 - _SAME)

    def _go(self, stop: float, limit: float) -> bool:
        if self._steps is None:
            ready = self._open.enter_context(open_simulation(self.scene))
            self._first, self._steps = ready.master.observe(), ready.steps(self._watch)
        before, begin = self.cost, time.thread_time()
        for log in self._steps:
            self._logs.append(log)
            self.cost = before + time.thread_time() - begin
            if self._beyond(stop) or self.cost > limit:
                break
        return self._beyond(stop)

    def _collected(self, status: str) -> xr.Dataset:
        names = {m.name: recorded_variables(m) for m in self.scene.members}
        return results.collect(self.scene, names, self._first, self._logs, status)


class Runs:
    """hear: told of every choice before it is run; watch: see Run. made: how many were."""

    def __init__(
        self,
        scene: Scene,
        hear: Callable[[Choice], None] = lambda choice: None,
        watch: Callable[[float], None] = lambda time: None,
    ) -> None:
        self.scene = scene
        self.asked = quantities(scene)
        self.made = 0
        self._hear, self._watch = hear, watch
        self._known: dict[tuple[tuple[str, int], ...], Run] = {}

    def __call__(self, choice: Choice, stop: float) -> Run:
        """The run with that choice, at least until `stop` [s]. Raises the error with which it ended before."""
        key = tuple(sorted(choice.items()))
        if key not in self._known:
            self._hear(choice)
            self.made += 1
            self._known[key] = Run(applied(self.scene, choice), self._watch)
        self._known[key].reach(stop)
        return self._known[key]

    def gap(self, choice: Choice, better: Choice, stop: float) -> float:
        """How far the two lie apart in what is asked for, share of its range; inf where the first fails."""
        other = self(better, stop).course(self.asked, stop)
        try:
            found = error(self(choice, stop).course(self.asked, stop), other, self.asked)
        except CosimError:
            return math.inf
        return found if math.isfinite(found) else math.inf

    def close(self) -> None:
        """Frees all FMUs. What has been computed stays; runs that had not come to the end are forgotten."""
        for run in self._known.values():
            run.close()
        self._known = {key: run for key, run in self._known.items() if run.ended}
