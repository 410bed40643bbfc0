"""Broyden's good method: a rank-1 update of J = dr/dx after each sweep (Broyden 1965).

J is kept from step to step. The first J of a run is a multiple of I with the size that the first two sweeps show.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .history import IterationHistory, first_step

__all__ = ["Broyden"]


@dataclass(frozen=True)
class Broyden:
    """Broyden's good method. `omega` relaxes a run's first update."""

    omega: float = 0.25

    def update(self, history: IterationHistory) -> np.ndarray:
        """Return the quasi-Newton step (n,). Raises LinAlgError."""
        r, jacobian = history.r[-1], history.memory
        if len(history.r) > 1:
            dx, dr = history.x[-1] - history.x[-2], r - history.r[-2]
            if jacobian is None:
                jacobian = np.eye(r.size) * (dr @ dx) / (dx @ dx)
            jacobian = jacobian + np.outer(dr - jacobian @ dx, dx) / (dx @ dx)
        elif jacobian is None:
            return first_step(self.omega, r)
        history.memory = jacobian
        return np.linalg.solve(jacobian, -r)
