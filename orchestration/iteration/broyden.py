"""Broyden's good method: the rank-1 change of J = dr/dx that the last sweep asks for; J is kept from step to step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .trace import Trace

__all__ = ["Broyden"]


@dataclass(frozen=True)
class Broyden:
    omega: float = 0.25  # the first J of a run is -I/omega

    def update(self, trace: Trace) -> np.ndarray:
        r = trace.r[-1]
        jacobian = -np.eye(r.size) / self.omega if trace.memory is None else trace.memory
        if len(trace.r) > 1:
            dx, dr = trace.x[-1] - trace.x[-2], r - trace.r[-2]
            jacobian = jacobian + np.outer(dr - jacobian @ dx, dx) / (dx @ dx)
        trace.memory = jacobian
        return np.linalg.solve(jacobian, -r)
