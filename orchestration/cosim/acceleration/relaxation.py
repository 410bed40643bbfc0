"""Constant relaxation: x+ = x + omega r. For a loop gain -g it converges for 0 < omega < 2/(1+g), best 1/(1+g)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .history import IterationHistory

__all__ = ["Relaxation"]


@dataclass(frozen=True)
class Relaxation:
    """Constant relaxation by `omega`."""

    omega: float = 0.5

    def update(self, history: IterationHistory) -> np.ndarray:
        """Return the relaxed residual (n,)."""
        return self.omega * history.r[-1]
