"""Aitken's relaxation: omega_k = -dx.dr/|dr|^2.

dx = omega_(k-1) r_(k-1) is the last change of the guess, dr that of the residual. One linear unknown is exact in the
third sweep (Irons and Tuck 1969).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .history import IterationHistory, first_step

__all__ = ["Aitken"]


@dataclass(frozen=True)
class Aitken:
    """Aitken's relaxation. `omega` is that of a run's first update; later steps start from the last one before."""

    omega: float = 0.5

    def update(self, history: IterationHistory) -> np.ndarray:
        """Return the relaxed residual (n,)."""
        r = history.r[-1]
        if len(history.r) > 1:
            dx, dr = history.x[-1] - history.x[-2], r - history.r[-2]
            history.memory = -(dx @ dr) / (dr @ dr)
        return first_step(self.omega, r) if history.memory is None else history.memory * r
