"""Runs of a scene with different choices: each is made once and only as far as needed; results and costs are kept."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from ...cosim.acceleration import spectral_radius
from ...cosim.master import StepLog
from ...cosim.step_logs import StepLogs
from ...errors import CosimError
from ...results import ResultTable
from ...scene import Scene
from ...simulation import OpenSimulation, open_simulation, recorded_variables
from .hierarchy import Choice, apply_choice
from .measure import Quantity, Trajectory, relative_error, requested_quantities

__all__ = ["ResumableRun", "RunCache"]

_PARTS = (1 / 16, 1 / 4, 1.0)  # of a run, after which its error is looked at
_CLEARLY = 1.01  # error of a part / limit from which on it exceeds: shares of macro steps are not exact
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
    def last_steps(self) -> Sequence[StepLog]:
        """The last macro steps taken, up to ten."""
        return [self._logs[k] for k in range(max(len(self._logs) - 10, 0), len(self._logs))]

    @property
    def loop_gain(self) -> float:
        """Largest spectral radius of a sweep's derivative in the steps so far; 0 where no loop showed one."""
        _, inverses = self._logs.inverses()
        return float(spectral_radius(inverses).max()) if len(inverses) else 0.0

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
                self._watch(self._logs[-1].time)  # the generator would do so only when asked for the next part
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
    limit : float
        CPU time after which a run is given up [s].
    """

    def __init__(
        self,
        scene: Scene,
        announce: Callable[[Choice], None] = lambda choice: None,
        watch: Callable[[float], None] = lambda time: None,
        limit: float = math.inf,
        words: Callable[[Choice], str] = str,
    ) -> None:
        """Open an empty cache; announce is called with every choice before its run, watch after every macro step.

        words: what a message says of a choice.
        """
        self.scene = scene
        self.quantities = requested_quantities(scene)
        self.count = 0
        self.limit = limit
        self._announce, self._watch, self._words = announce, watch, words
        self._runs: dict[tuple[tuple[str, int], ...], ResumableRun] = {}

    def __call__(self, choice: Choice, stop: float) -> ResumableRun:
        """The run with that choice, at least until `stop` [s].

        Raises the error with which it ended before, and CosimError where it takes longer than the limit.
        """
        key = tuple(sorted(choice.items()))
        if key not in self._runs:
            self._announce(choice)
            self.count += 1
            self._runs[key] = ResumableRun(apply_choice(self.scene, choice), self._watch)
        run = self._runs[key]
        if not run.advance_to(stop, self.limit) and run.cost > self.limit:  # an FMU may end its simulation before
            raise CosimError(f"{self.scene.name}: {self._given_up(choice, run, stop)}")
        return run

    def _given_up(self, choice: Choice, run: ResumableRun, stop: float) -> str:
        """Message on a run that takes too long."""
        last = run.last_steps
        return (
            f"the search ends, since run {self.count} takes too long: {run.cost:.0f} s of CPU time to "
            f"t = {last[-1].time:.4g} s of {stop:.4g} s ({self._words(choice)}). Its last macro steps took up to "
            f"{max(log.sweeps for log in last)} sweeps at coupling.macro_step = {run.scene.coupling.macro_step:.4g} s; "
            "make it shorter, so that it resolves what moves fast, such as a contact, ask for less "
            "(fidelity.tolerance), or choose the levels yourself (fidelity.level = 'given')"
        )

    def difference(self, choice: Choice, finer: Choice, stop: float, limit: float = math.inf) -> float:
        """Error of `choice` relative to `finer` until `stop` [s], share of the range; inf where `choice` fails.

        Where a first part of the run shows that the error of the whole exceeds `limit`, its error is the answer.
        """
        reference = self(finer, stop).trajectory(self.quantities, stop)
        for share in _PARTS if math.isfinite(limit) else (1.0,):
            try:
                run = self(choice, share * stop)
            except CosimError:
                return math.inf
            error = relative_error(run.trajectory(self.quantities, share * stop), reference, self.quantities)
            if not math.isfinite(error):
                return math.inf
            if math.sqrt(share) * error > _CLEARLY * limit:  # squares of the rest are positive
                break
        return error

    def first_parts_differ(self, choice: Choice, finer: Choice, stop: float, limit: float, like: Choice) -> bool:
        """Whether first parts of two runs show that their difference until `stop` [s] exceeds `limit`.

        like: the choice whose run until then tells the ranges of the whole. A run that fails shows it too.
        """
        ranges = self(like, stop).trajectory(self.quantities, stop)
        for share in _PARTS[:-1]:
            reference = self(finer, share * stop).trajectory(self.quantities, share * stop)
            try:
                run = self(choice, share * stop)
            except CosimError:
                return True
            part = run.trajectory(self.quantities, share * stop)
            if not math.sqrt(share) * relative_error(part, reference, self.quantities, ranges) <= limit:
                return True
        return False

    def cost(self, choice: Choice) -> float:
        """CPU time of the run with that choice so far [s]; 0 where there is none."""
        run = self._runs.get(tuple(sorted(choice.items())))
        return run.cost if run else 0.0

    def close(self) -> None:
        """Free all FMUs. Results stay; runs that had not come to their end are dropped."""
        for run in self._runs.values():
            run.close()
        self._runs = {key: run for key, run in self._runs.items() if run.ended}
