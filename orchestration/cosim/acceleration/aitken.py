"""Aitken's relaxation: omega_k = -dx.dr/|dr|^2 with the last changes dx = omega_(k-1) r_(k-1) of the guess and dr of
the residual. Exact third sweep for one linear loop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .history import IterationHistory, first_step

__all__ = ["Aitken"]


@dataclass(frozen=True)
class Aitken:
    omega: float = 0.5  # of the first update of a run; later steps start from the last omega of the step before

    def update(self, trace: IterationHistory) -> np.ndarray:
        r = trace.r[-1]
        if len(trace.r) > 1:
            dx, dr = trace.x[-1] - trace.x[-2], r - trace.r[-2]
            trace.memory = -(dx @ dr) / (dr @ dr)
        return first_step(self.omega, r) if trace.memory is None else trace.memory * r
