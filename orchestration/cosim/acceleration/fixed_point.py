"""Fixed point: x+ = G(x). Converges where the spectral radius of the loop is below 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .history import IterationHistory

__all__ = ["Plain"]


@dataclass(frozen=True)
class Plain:
    def update(self, trace: IterationHistory) -> np.ndarray:
        return trace.r[-1]
