"""Fixed-point iteration: x+ = G(x). It converges where the spectral radius of the loop is below 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .history import IterationHistory

__all__ = ["FixedPoint"]


@dataclass(frozen=True)
class FixedPoint:
    """Plain iteration."""

    def update(self, history: IterationHistory) -> np.ndarray:
        """Return the residual (n,)."""
        return history.r[-1]
