"""Newton's method with an interface Jacobian that is kept from step to step and renewed when it contracts too little.

The Jacobian is formed from n perturbed sweeps (FiniteDifferenceNewton), or from the subsystems' directional
derivatives, which cost no sweep (TangentNewton).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from .bisection import bisected_step
from .history import IterationHistory

__all__ = ["FiniteDifferenceNewton", "TangentNewton"]

TANGENT_CONTRACTION = 0.5  # residual ratio above which directional derivatives are not those of the loop


@dataclass
class _Differences:
    """State of a Jacobian that is being formed: where it started, and the columns so far."""

    x: np.ndarray
    r: np.ndarray
    columns: list[np.ndarray] = field(default_factory=list)


@dataclass
class _Memory:
    """What is kept over macro steps.

    Attributes
    ----------
    last : float
        Norm of the residual before the last update.
    growths : int
        Number of updates in this macro step after which the residual was larger.
    bisection : iterator of ndarray
        Changes of the guess that are left of a bisected update.
    trusts_tangents : bool
        Whether the subsystems' directional derivatives are used.
    is_tangent : bool
        Whether the Jacobian was taken from them at the guess before.
    """

    jacobian: np.ndarray | None = None
    differences: _Differences | None = None
    last: float = np.inf
    growths: int = 0
    bisection: Iterator[np.ndarray] = field(default_factory=lambda: iter(()))
    trusts_tangents: bool = True
    is_tangent: bool = False


@dataclass(frozen=True)
class FiniteDifferenceNewton:
    """Newton's method with differences.

    Attributes
    ----------
    step : float
        Perturbation, in units of the nominals.
    contraction : float
        Ratio of residuals above which the Jacobian is renewed.
    """

    step: float = 1e-5
    contraction: float = 0.1

    def update(self, history: IterationHistory) -> np.ndarray:
        """Return the Newton step (n,), or the next perturbation. Raises LinAlgError."""
        x, r = history.x[-1], history.r[-1]
        memory = history.memory = history.memory or _Memory()
        if len(history.r) == 1:  # a new macro step: only the Jacobian is kept
            memory.differences, memory.last, memory.is_tangent = None, np.inf, False
            memory.growths, memory.bisection = 0, iter(())
        if memory.differences is not None:
            return self._next_difference(memory, memory.differences, x, r)
        norm = np.abs(r).max()
        if memory.last < norm < np.inf:
            memory.growths += 1
            if memory.growths > 1:  # the first may find the side of a kink that the solution is on
                memory.bisection = bisected_step(history)
        if (change := next(memory.bisection, None)) is not None:
            memory.jacobian, memory.last = None, np.inf
            return change
        if memory.jacobian is None or norm > self.contraction * memory.last:
            jacobian = self._tangent(history, memory, norm)
            if jacobian is None:
                memory.differences = _Differences(x, r)
                return self._perturbation(memory.differences, x)
            memory.jacobian = jacobian
        memory.last = norm
        return np.linalg.solve(memory.jacobian, -r)

    def _tangent(self, history: IterationHistory, memory: _Memory, norm: float) -> np.ndarray | None:
        """Return dr/dx (n, n) at the present guess without a sweep; None where it is not known."""
        return None

    def _perturbation(self, differences: _Differences, x: np.ndarray) -> np.ndarray:
        target = differences.x.copy()
        target[len(differences.columns)] += self.step
        return target - x

    def _next_difference(self, memory: _Memory, differences: _Differences, x: np.ndarray, r: np.ndarray) -> np.ndarray:
        differences.columns.append((r - differences.r) / self.step)
        if len(differences.columns) < x.size:
            return self._perturbation(differences, x)
        memory.jacobian = np.array(differences.columns).T
        memory.differences, memory.last = None, np.abs(differences.r).max()
        return differences.x + np.linalg.solve(memory.jacobian, -differences.r) - x


@dataclass(frozen=True)
class TangentNewton(FiniteDifferenceNewton):
    """Newton's method with directional derivatives.

    They belong to an instant. They are those of a whole step where outputs follow inputs at once, as a quasi-static
    rod's do. Where a Jacobian of them does not even halve the residual, the loop has dynamic states, and differences
    are used from then on.
    """

    def _tangent(self, history: IterationHistory, memory: _Memory, norm: float) -> np.ndarray | None:
        if memory.is_tangent and norm > TANGENT_CONTRACTION * memory.last:
            memory.trusts_tangents = False
        jacobian = history.jacobian() if memory.trusts_tangents else None
        memory.is_tangent = jacobian is not None
        return jacobian
