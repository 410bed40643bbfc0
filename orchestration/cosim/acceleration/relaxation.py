"""Constant relaxation: x+ = x + omega r. For one loop gain -g it converges where 0 < omega < 2/(1+g), best 1/(1+g)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .history import IterationHistory

__all__ = ["Relaxed"]


@dataclass(frozen=True)
class Relaxed:
    omega: float = 0.5

    def update(self, trace: IterationHistory) -> np.ndarray:
        return self.omega * trace.r[-1]
