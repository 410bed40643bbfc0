"""Newton with an interface Jacobian from n perturbed sweeps, kept from step to step and renewed when it contracts too
little."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .trace import Trace

__all__ = ["Newton"]


@dataclass
class _Probe:
    """Where the forming of a Jacobian stands."""

    x: np.ndarray
    r: np.ndarray
    columns: list[np.ndarray] = field(default_factory=list)


@dataclass
class _Memory:
    jacobian: np.ndarray | None = None
    probe: _Probe | None = None
    last: float = np.inf  # norm of the residual before the last update


@dataclass(frozen=True)
class Newton:
    step: float = 1e-5  # perturbation, in units of the nominals
    contraction: float = 0.1  # a Jacobian that reduces the residual by less is renewed

    def update(self, trace: Trace) -> np.ndarray:
        x, r = trace.x[-1], trace.r[-1]
        memory = trace.memory = trace.memory or _Memory()
        if len(trace.r) == 1:  # a new macro step: the Jacobian stays, all else is of the step before
            memory.probe, memory.last = None, np.inf
        if memory.probe is not None:
            return self._probed(memory, x, r)
        norm = np.abs(r).max()
        if memory.jacobian is None or norm > self.contraction * memory.last:
            memory.probe = _Probe(x, r)
            return self._perturbed(memory.probe, x)
        memory.last = norm
        return np.linalg.solve(memory.jacobian, -r)

    def _perturbed(self, probe: _Probe, x: np.ndarray) -> np.ndarray:
        target = probe.x.copy()
        target[len(probe.columns)] += self.step
        return target - x

    def _probed(self, memory: _Memory, x: np.ndarray, r: np.ndarray) -> np.ndarray:
        probe = memory.probe
        probe.columns.append((r - probe.r) / self.step)
        if len(probe.columns) < x.size:
            return self._perturbed(probe, x)
        memory.jacobian = np.array(probe.columns).T
        memory.probe, memory.last = None, np.abs(probe.r).max()
        return probe.x + np.linalg.solve(memory.jacobian, -probe.r) - x
