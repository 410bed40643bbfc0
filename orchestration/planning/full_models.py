"""A plan run by the full models: its error, its temperatures, the limits that act."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..cosim.signals import Steps
from ..errors import FmuWarning
from ..fmi.archive import Archive
from ..fmi.vectors import split_index
from ..results import ResultTable
from ..scene import Member, Scene, changed
from ..scene.manipulator import TEMPERATURE, VOLTAGE
from ..simulation import run_table
from .heat import HOTTEST
from .limits import PlanLimits
from .manipulator import Manipulator
from .target import Target

__all__ = ["FullModels", "prefix_of"]

AT_LIMIT = 1e-3  # share of the voltage within which it is at a limit
NEAR_LIMIT = 0.1  # [K] within which a temperature is at its limit
EXCESS = 0.01  # [K] by which the full models may pass a limit of temperature: rounding of the plan
STEPS_PER_KNOT = 4  # macro steps of the check, at least: errors between knots count too
MAX_SPANS = 4  # spans of time that a text names


def prefix_of(sections: Sequence[Member], section: Member) -> str:
    """Return what distinguishes the names of a section's variables: nothing where there is one section only."""
    return f"{section.name}." if len(sections) > 1 else ""


class FullModels:
    """Runs of a scene with planned voltages.

    Parameters
    ----------
    scene : Scene
    target : Target
    limits : PlanLimits
    """

    def __init__(self, scene: Scene, target: Target, limits: PlanLimits) -> None:
        self._scene, self._target, self._limits = scene, target, limits
        manipulator = Manipulator.of(scene)
        self._rod, self._sections = manipulator.rod.name, manipulator.sections

    def run(self, times: np.ndarray, voltages: np.ndarray) -> tuple[Scene, ResultTable]:
        """Run the scene with voltages (K, N) [V] up to knots at times (K,) [s]; return it and its result."""
        scene, starts = self._scene, (0.0, *times[:-1])
        signals = iter(Steps(starts, tuple(column)) for column in voltages.T)
        values = {f"{m.name}.{VOLTAGE}": [next(signals) for _ in m.archive.vectors[VOLTAGE]] for m in self._sections}
        step = min(scene.coupling.macro_step, float(times[0]) / STEPS_PER_KNOT)
        settings = {**values, "stop_time": float(times[-1]), "coupling.macro_step": step}
        open_already = {m.archive.path: m.archive for m in scene.members}
        planned = changed(scene, settings, lambda path: open_already.get(path) or Archive(path), origin="plan")
        planned = replace(planned, title=scene.title, layers=scene.layers)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FmuWarning)  # of rounds that are not the last; the result has them all
            return planned, run_table(planned)

    def at(self, table: ResultTable, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the outputs (K, p) and the temperatures (K, N) [K] of a result at times (K,) [s]."""
        rows = np.searchsorted(table["time"].to_numpy(), times - 1e-9 * times[-1])
        return self._outputs(table)[rows], self._temperatures(table)[rows]

    def differences(self, table: ResultTable) -> tuple[np.ndarray, np.ndarray]:
        """Return the times (n,) [s] of a result from the path's first on, and the differences from it then (n, p)."""
        when = table["time"].to_numpy()
        inside = when >= self._target.times[0] - 1e-9
        return when[inside], self._outputs(table)[inside] - self._target.at(when[inside])

    def keeps_limits(self, table: ResultTable) -> bool:
        """Tell whether a run keeps the limits of temperature, but for EXCESS."""
        mean = float(self._temperatures(table).max())
        return mean <= self._limits.temperature + EXCESS and self.hottest(table) <= self._limits.hottest + EXCESS

    def hottest(self, table: ResultTable) -> float:
        """Return the highest temperature of a run [K]."""
        return max(float(table[f"{m.name}.{HOTTEST}"].to_numpy().max()) for m in self._sections)

    def active_limits(self, table: ResultTable, knots: np.ndarray, voltages: np.ndarray) -> list[str]:
        """Return the limits that act, with the spans of time in which they do; knots: (K + 1,) [s]."""
        limits, texts, when = self._limits, [], table["time"].to_numpy()
        names = [f"{prefix_of(self._sections, m)}{v}" for m in self._sections for v in m.archive.vectors[VOLTAGE]]
        for name, V in zip(names, voltages.T, strict=True):
            texts += _spans(f"{name} at {limits.voltage:g} V", limits.voltage * (1.0 - AT_LIMIT) <= V, knots)
            texts += _spans(f"{name} at 0 V", limits.voltage * AT_LIMIT >= V, knots)
        most = limits.voltage_rate * (knots[1] - knots[0])
        changes = np.abs(np.diff(voltages, axis=0, prepend=0.0))
        for name, change in zip(names, changes.T, strict=True):
            acts = change >= most * (1.0 - AT_LIMIT)
            texts += _spans(f"{name} changes by {limits.voltage_rate:g} V/s", acts, knots)
        names = [f"{prefix_of(self._sections, m)}{T}" for m in self._sections for T in m.archive.vectors[TEMPERATURE]]
        for name, T in zip(names, self._temperatures(table).T, strict=True):
            acts = T[:-1] >= limits.temperature - NEAR_LIMIT
            texts += _spans(f"{name} at {limits.temperature - 273.15:.4g} degC", acts, when)
        for section in self._sections:
            hottest, prefix = table[f"{section.name}.{HOTTEST}"].to_numpy(), prefix_of(self._sections, section)
            acts = hottest[:-1] >= limits.hottest - NEAR_LIMIT
            texts += _spans(f"{prefix}hottest point at {limits.hottest - 273.15:.4g} degC", acts, when)
        return texts

    def _outputs(self, table: ResultTable) -> np.ndarray:
        columns = []
        for name in self._target.outputs:
            base, index = split_index(name)
            array = table[f"{self._rod}.{base}"].to_numpy()
            for k in index:
                array = array[:, k - 1]
            columns.append(array)
        return np.stack(columns, axis=1)

    def _temperatures(self, table: ResultTable) -> np.ndarray:
        return np.hstack([table[f"{m.name}.{TEMPERATURE}"].to_numpy() for m in self._sections])


def _spans(name: str, acts: np.ndarray, knots: np.ndarray) -> list[str]:
    """Return 'name from a to b s, c to d s' for the intervals in which it acts; nothing where it never does."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], acts, [False]]).astype(int)))
    spans = [f"{knots[a]:.4g} to {knots[b]:.4g} s" for a, b in zip(edges[::2], edges[1::2], strict=True)]
    if not spans:
        return []
    shown = spans[:MAX_SPANS] + ([f"and {len(spans) - MAX_SPANS} more"] if len(spans) > MAX_SPANS else [])
    return [f"{name}: {', '.join(shown)}"]
