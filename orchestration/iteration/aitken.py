"""Aitken's relaxation: omega_k = -omega_(k-1) r_(k-1).dr/|dr|^2, dr = r_k - r_(k-1). Exact third sweep for one linear
loop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .trace import Trace

__all__ = ["Aitken"]


@dataclass(frozen=True)
class Aitken:
    omega: float = 0.5  # of the first update of a run; later steps start from the last omega of the step before

    def update(self, trace: Trace) -> np.ndarray:
        r = trace.r[-1]
        omega = self.omega if trace.memory is None else trace.memory
        if len(trace.r) > 1:
            dr = r - trace.r[-2]
            omega *= -(trace.r[-2] @ dr) / (dr @ dr)
        trace.memory = omega
        return omega * r
