"""Broyden's good method: the rank-1 change of J = dr/dx that the last sweep asks for; J is kept from step to step. The
first J of a run is a multiple of I, its size what the first two sweeps tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .history import IterationHistory, first_step

__all__ = ["Broyden"]


@dataclass(frozen=True)
class Broyden:
    omega: float = 0.25  # of the first update of a run

    def update(self, trace: IterationHistory) -> np.ndarray:
        r, jacobian = trace.r[-1], trace.memory
        if len(trace.r) > 1:
            dx, dr = trace.x[-1] - trace.x[-2], r - trace.r[-2]
            if jacobian is None:
                jacobian = np.eye(r.size) * (dr @ dx) / (dx @ dx)
            jacobian = jacobian + np.outer(dr - jacobian @ dx, dx) / (dx @ dx)
        elif jacobian is None:
            return first_step(self.omega, r)
        trace.memory = jacobian
        return np.linalg.solve(jacobian, -r)
