"""Newton with an interface Jacobian that is kept from step to step and renewed when it contracts too little: formed
from n perturbed sweeps, or taken from the subsystems' own tangents, which cost no sweep."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .history import IterationHistory

__all__ = ["Newton", "Tangent"]


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
    tangents: bool = True  # whether those of the subsystems are to be trusted
    is_tangent: bool = False  # the Jacobian was taken at the guess before


@dataclass(frozen=True)
class Newton:
    step: float = 1e-5  # perturbation, in units of the nominals
    contraction: float = 0.1  # a Jacobian that reduces the residual by less is renewed

    def update(self, trace: IterationHistory) -> np.ndarray:
        x, r = trace.x[-1], trace.r[-1]
        memory = trace.memory = trace.memory or _Memory()
        if len(trace.r) == 1:  # a new macro step: the Jacobian stays, all else is of the step before
            memory.probe, memory.last, memory.is_tangent = None, np.inf, False
        if memory.probe is not None:
            return self._probed(memory, memory.probe, x, r)
        norm = np.abs(r).max()
        if memory.jacobian is None or norm > self.contraction * memory.last:
            jacobian = self._tangent(trace, memory, norm)
            if jacobian is None:
                memory.probe = _Probe(x, r)
                return self._perturbed(memory.probe, x)
            memory.jacobian = jacobian
        memory.last = norm
        return np.linalg.solve(memory.jacobian, -r)

    def _tangent(self, trace: IterationHistory, memory: _Memory, norm: float) -> np.ndarray | None:
        """dr/dx (n, n) at the present guess without a sweep; None: not known."""
        return None

    def _perturbed(self, probe: _Probe, x: np.ndarray) -> np.ndarray:
        target = probe.x.copy()
        target[len(probe.columns)] += self.step
        return target - x

    def _probed(self, memory: _Memory, probe: _Probe, x: np.ndarray, r: np.ndarray) -> np.ndarray:
        probe.columns.append((r - probe.r) / self.step)
        if len(probe.columns) < x.size:
            return self._perturbed(probe, x)
        memory.jacobian = np.array(probe.columns).T
        memory.probe, memory.last = None, np.abs(probe.r).max()
        return probe.x + np.linalg.solve(memory.jacobian, -probe.r) - x


@dataclass(frozen=True)
class Tangent(Newton):
    """Directional derivatives belong to an instant: they are those of a whole step where outputs follow inputs at once,
    as a quasi-static rod's do. A Jacobian of them that does not even halve the residual is of a loop with a past, where
    perturbed sweeps take over for good."""

    def _tangent(self, trace: IterationHistory, memory: _Memory, norm: float) -> np.ndarray | None:
        if memory.is_tangent and norm > 0.5 * memory.last:
            memory.tangents = False
        found = trace.tangent() if memory.tangents else None
        memory.is_tangent = found is not None
        return found
