"""The solvers that a chart compares, behind one protocol, so that all are timed alike: loaded and made ready untimed,
run timed."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any, ClassVar, Protocol

import numpy as np
import xarray as xr

from .. import monolith, reference, results
from ..archive import Variable
from ..closing import closed_inside
from ..errors import CosimError
from ..fidelity import fit
from ..fidelity.ladder import applied, ladder
from ..master import StepLog
from ..scene import Member, Scene, read
from ..simulate import prepared, recorded
from ..slave import Slave
from .norm import QUANTITIES

__all__ = ["SOLVERS", "Solver", "moves"]

COUNT = "evaluations"  # output of rod.fmu


class Solver(Protocol):
    """Loads when made: (scene, overrides, times (n,) of the output [s], settings). work: evaluations of the rod's
    equations in the first run, which no machine changes; nan where nothing is counted."""

    settings: ClassVar[tuple[str, ...]]
    work: float

    def __init__(self, source: str, overrides: Sequence[str], times: np.ndarray, **settings: Any) -> None: ...

    def ready(self) -> None:
        """Back to the start, as if nothing had been run."""

    def run(self, limit: float) -> None:
        """To the stop time. limit [s] of CPU time, inf: not looked at. Raises CosimError."""

    def result(self) -> xr.Dataset:
        """Of the last run, with the output times among its times."""

    def close(self) -> None: ...


class CoSimulation:
    """work: residuals, those of steps that were taken back included."""

    settings: ClassVar[tuple[str, ...]] = ("steps",)  # macro steps per output

    def __init__(self, source: str, overrides: Sequence[str], times: np.ndarray, steps: int = 1) -> None:
        self._load(read(source, [*overrides, f"coupling.macro_step={float(times[1] - times[0]) / steps}"]), times)

    def _load(self, scene: Scene, times: np.ndarray) -> None:
        self.scene = scene
        self._times, self._open = times, contextlib.ExitStack()
        self._ready = self._open.enter_context(prepared(self.scene))
        master = self._ready.master
        self._start = master.place()
        self._open.callback(master.release, self._start)
        master.save(self._start)
        self._first, self._logs = master.observe(), list[StepLog]()
        self._counters = [_Counter(m, slave) for m, slave in zip(scene.members, self._ready.slaves, strict=True)]
        self.work = np.nan

    def ready(self) -> None:
        self._ready.master.restart(self._start)

    def run(self, limit: float) -> None:
        watch = _watch(limit) if limit < np.inf else (lambda time: None)
        self._logs = list(self._ready.steps(watch, self._times))
        if self._counters:
            found = [counter.close() for counter in self._counters]
            self.work, self._counters = float(np.nansum(found)) if np.isfinite(found).any() else np.nan, []

    def result(self) -> xr.Dataset:
        names: dict[str, Sequence[Variable]] = {m.name: recorded(m) for m in self.scene.members}
        return results.collect(self.scene, names, self._first, self._logs, "complete")

    def close(self) -> None:
        self._open.close()


class _Counter:
    """Watches the output `evaluations` of an FMU, if it has one, which a restored state sets back."""

    def __init__(self, member: Member, slave: Slave) -> None:
        names = [variable.name for variable in recorded(member)]
        self._slave, self._total = slave, np.nan
        if COUNT in names:
            self._place, self._total = names.index(COUNT), 0.0
            self._last, self._watched = self._now(), (slave.step, slave.restore)
            vars(slave).update(step=self._step, restore=self._restore)

    def close(self) -> float:
        """The total; it counts no more."""
        for name in ("step", "restore"):
            vars(self._slave).pop(name, None)
        return self._total

    def _now(self) -> float:
        return float(self._slave.record()[self._place])

    def _step(self, time: float, length: float) -> None:
        self._watched[0](time, length)
        now = self._now()
        self._total += now - self._last
        self._last = now

    def _restore(self, state: Any) -> None:
        self._watched[1](state)
        self._last = self._now()


class Auto(CoSimulation):
    """Models and macro step chosen by fit() for all that a chart's error is made of; the choice is part of loading. The
    truth has inertia where the scene has it, so that this may leave it out, but not add it."""

    settings: ClassVar[tuple[str, ...]] = ("tolerance",)

    def __init__(self, source: str, overrides: Sequence[str], times: np.ndarray, tolerance: float = 1e-3) -> None:
        asked = [
            f"fidelity.quantities={list(QUANTITIES)}",
            f"fidelity.tolerance={tolerance}",
            f"coupling.macro_step={float(times[1] - times[0])}",
        ]
        scene = read(source, [*overrides, *asked])
        fitted = fit(scene, axes=tuple(axis for axis in ladder(scene) if axis.name != "inertia" or moves(scene)))
        self._load(applied(fitted.scene, fitted.found.choice), times)


class Monolith:
    """work: right-hand sides."""

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

    def ready(self) -> None:
        self._open.close()
        self._assemble()

    def run(self, limit: float) -> None:
        watch = _watch(limit)
        self._logs = monolith.logged(self.scene, self._system, self._tolerance, self._times, watch)

    def result(self) -> xr.Dataset:
        return monolith.result(self.scene, self._logs, self._tolerance)

    def close(self) -> None:
        self._open.close()

    def _assemble(self) -> None:
        self._system = self._open.enter_context(monolith.assembled(self.scene))


class Reference:
    """numpy and scipy alone. The limit is looked at afterwards."""

    settings: ClassVar[tuple[str, ...]] = tuple(f.name for f in fields(reference.Resolution))
    work = np.nan  # right-hand sides of the moving rod, shots through the resting one

    def __init__(self, source: str, overrides: Sequence[str], times: np.ndarray, **resolution: Any) -> None:
        self._solve = reference.prepared(read(source, overrides), reference.Resolution(**resolution), times)
        self._result = xr.Dataset()

    def ready(self) -> None: ...

    def run(self, limit: float) -> None:
        self._result = self._solve()
        self.work = self._result.attrs["evaluations"]

    def result(self) -> xr.Dataset:
        return self._result

    def close(self) -> None: ...


SOLVERS: dict[str, type[Solver]] = {
    "cosimulation": CoSimulation,
    "auto": Auto,
    "monolith": Monolith,
    "reference": Reference,
}


def moves(scene: Scene) -> bool:
    """Whether anything in it has inertia."""
    return any(m.value("dynamic") for m in scene.members)


def _watch(limit: float) -> Callable[[float], None]:
    """Raises CosimError when the CPU time from now on is used up."""
    end = time.process_time() + limit

    def look(now: float) -> None:
        if time.process_time() > end:
            raise CosimError(f"stopped at t = {now:.4g} s after {limit:g} s of CPU time")

    return look
