"""The solvers of a chart behind one protocol, so that all are timed alike.

Loading and rewinding are not timed, runs are.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any, ClassVar, Protocol

import numpy as np
import xarray as xr

from ... import results
from ...cosim.master import StepLog
from ...cosim.subsystem import Recorder
from ...fmi.archive import Variable
from ...scene import Member, Scene, read
from ...scene.loop_closure import closed_inside
from ...simulation import open_simulation, recorded_variables
from ...studies.model_selection import select
from ...studies.model_selection.hierarchy import apply_choice, model_hierarchies
from ...verification import monolith, reference
from .norm import QUANTITIES

__all__ = ["SOLVERS", "Solver", "TimeLimitError", "has_inertia"]

COUNT = "evaluations"  # output of rod.fmu that counts evaluations of its residual
PATIENCE = 20.0  # limit of a search, and of solvers in Python, over that of a run


class TimeLimitError(Exception):
    """The CPU time is used up.

    Not a CosimError: a search would take that for a run that fails, and go on.
    """


class Solver(Protocol):
    """A solver of a scene; loads when made.

    Attributes
    ----------
    settings : tuple of str
        Keyword arguments that series may sweep.
    work : float
        Evaluations of the rod's equations in the first run, which do not depend on the machine; nan where none are
        counted.
    """

    settings: ClassVar[tuple[str, ...]]
    work: float

    def __init__(self, source: str, overrides: Sequence[str], times: np.ndarray, **settings: Any) -> None:
        """Load the scene with overrides, for outputs at times (n,) [s]."""

    def rewind(self) -> None:
        """Go back to the start, as if nothing had been run."""

    def run(self, limit: float) -> None:
        """Run to the stop time.

        limit: CPU time [s]; PATIENCE times that for a search or a solver in Python; inf: none. Raises CosimError,
        TimeLimitError.
        """

    def result(self) -> xr.Dataset:
        """The result of the last run, with the output times among its times."""

    def close(self) -> None:
        """Free the FMUs."""


class CoSimulation:
    """The master with the scene's coupling. work: residuals, also of steps that were repeated."""

    settings: ClassVar[tuple[str, ...]] = ("steps",)  # macro steps per output

    def __init__(self, source: str, overrides: Sequence[str], times: np.ndarray, steps: int = 1) -> None:
        self._load(read(source, [*overrides, f"coupling.macro_step={float(times[1] - times[0]) / steps}"]), times)

    def _load(self, scene: Scene, times: np.ndarray) -> None:
        self.scene = scene
        self._times, self._open = times, contextlib.ExitStack()
        self._ready = self._open.enter_context(open_simulation(self.scene))
        master = self._ready.master
        self._start = master.checkpoint()
        self._open.callback(master.release, self._start)
        master.save(self._start)
        self._first, self._logs = master.observe(), list[StepLog]()
        self._counters = {
            m.name: _Counter(m, slave) for m, slave in zip(scene.members, self._ready.slaves, strict=True)
        }
        for name, counter in self._counters.items():
            master.watch(name, counter)
        self.work = np.nan

    def rewind(self) -> None:
        self._ready.master.restart(self._start)

    def run(self, limit: float) -> None:
        self._logs = list(self._ready.steps(_watch(limit), self._times))
        if self._counters:
            totals = [counter.total for counter in self._counters.values()]
            self.work = float(np.nansum(totals)) if np.isfinite(totals).any() else np.nan
            for name in self._counters:
                self._ready.master.watch(name, None)
            self._counters = {}

    def result(self) -> xr.Dataset:
        names: dict[str, Sequence[Variable]] = {m.name: recorded_variables(m) for m in self.scene.members}
        return results.collect(self.scene, names, self._first, self._logs, "complete").to_xarray()

    def close(self) -> None:
        self._open.close()


class _Counter:
    """Counts what the output `evaluations` of an FMU adds up to, if it has one; restored states set that output back.

    total: the count so far; nan without such an output.
    """

    def __init__(self, member: Member, slave: Recorder) -> None:
        names = [variable.name for variable in recorded_variables(member)]
        self._slave, self._index = slave, names.index(COUNT) if COUNT in names else None
        self.total, self._last = (np.nan, np.nan) if self._index is None else (0.0, self._now())

    def stepped(self) -> None:
        """Add what the step took."""
        if self._index is not None:
            now = self._now()
            self.total += now - self._last
            self._last = now

    def restored(self) -> None:
        """Go on from the restored output."""
        if self._index is not None:
            self._last = self._now()

    def _now(self) -> float:
        return float(self._slave.record()[self._index])


class Auto(CoSimulation):
    """The master with models and macro step chosen by model selection for the quantities of the chart's error.

    The search is part of the first run. The reference has inertia where the scene has it, so that a choice may leave it
    out but not add it.
    """

    settings: ClassVar[tuple[str, ...]] = ("tolerance",)

    def __init__(self, source: str, overrides: Sequence[str], times: np.ndarray, tolerance: float = 1e-3) -> None:
        asked = [
            f"fidelity.quantities={list(QUANTITIES)}",
            f"fidelity.tolerance={tolerance}",
            f"coupling.macro_step={float(times[1] - times[0])}",
        ]
        self._asked, self._times, self._open = read(source, [*overrides, *asked]), times, contextlib.ExitStack()
        self._chosen = False

    def run(self, limit: float) -> None:
        if not self._chosen:
            hierarchies = model_hierarchies(self._asked)
            free = tuple(h for h in hierarchies if h.name != "inertia" or has_inertia(self._asked))
            selection = select(self._asked, hierarchies=free, watch=_watch(PATIENCE * limit, "search for a level, "))
            self._load(apply_choice(self._asked, selection.search.choice), self._times)
            self._chosen = True
        super().run(limit)


class Monolith:
    """All FMUs as one system. work: right-hand sides."""

    settings: ClassVar[tuple[str, ...]] = ("tolerance",)

    def __init__(self, source: str, overrides: Sequence[str], times: np.ndarray, tolerance: float = 1e-8) -> None:
        self.scene = closed_inside(read(source, overrides))
        self._times, self._tolerance = times, tolerance
        self._open = contextlib.ExitStack()
        self._logs: list[StepLog] = []
        self.work = 0.0
        self._assemble()
        rates = self._system.rates

        def counted() -> np.ndarray:
            self.work += 1
            return rates()

        vars(self._system)["rates"] = counted

    def rewind(self) -> None:
        self._open.close()
        self._assemble()

    def run(self, limit: float) -> None:
        self._logs = monolith.integrate(self.scene, self._system, self._tolerance, self._times, _watch(limit))

    def result(self) -> xr.Dataset:
        return monolith.monolith_result(self.scene, self._logs, self._tolerance)

    def close(self) -> None:
        self._open.close()

    def _assemble(self) -> None:
        self._system = self._open.enter_context(monolith.assembled(self.scene))


class Reference:
    """The independent solution in scipy."""

    settings: ClassVar[tuple[str, ...]] = tuple(f.name for f in fields(reference.Resolution))
    work = np.nan  # right-hand sides of a dynamic rod, shots of a quasi-static one

    def __init__(self, source: str, overrides: Sequence[str], times: np.ndarray, **resolution: Any) -> None:
        self._solve = reference.prepare(read(source, overrides), reference.Resolution(**resolution), times)
        self._result = xr.Dataset()

    def rewind(self) -> None:
        """Nothing to do: every run starts anew."""

    def run(self, limit: float) -> None:
        self._result = self._solve(_watch(PATIENCE * limit))
        self.work = self._result.attrs["evaluations"]

    def result(self) -> xr.Dataset:
        return self._result

    def close(self) -> None:
        """Nothing to free."""


SOLVERS: dict[str, type[Solver]] = {
    "cosimulation": CoSimulation,
    "auto": Auto,
    "monolith": Monolith,
    "reference": Reference,
}


def has_inertia(scene: Scene) -> bool:
    """Whether a member of the scene has inertia."""
    return any(m.value("dynamic") for m in scene.members)


def _watch(limit: float, what: str = "") -> Callable[[float], None]:
    """Function that raises TimeLimitError once the CPU time from now on exceeds `limit` [s]; inf: it never does."""
    end = time.process_time() + limit

    def check(now: float) -> None:
        if time.process_time() > end:
            raise TimeLimitError(f"{what}stopped at t = {now:.4g} s after {limit:g} s of CPU time")

    return check if limit < np.inf else (lambda time: None)
