"""IQN-ILS, the same as Anderson acceleration of depth n (Degroote 2009, Walker and Ni 2011).

The secant step over at most n filtered columns, kept from macro step to macro step (secants.py), plus a short fixed
point step in the directions that no column covers, no longer than the secant step or MAX_BLIND_STEP. A linear loop
takes at most n + 1 updates, one where the columns of earlier steps still hold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .history import MAX_BLIND_STEP, IterationHistory
from .secants import norm

__all__ = ["QuasiNewton"]


@dataclass(frozen=True)
class QuasiNewton:
    """IQN-ILS with columns of earlier macro steps."""

    def update(self, history: IterationHistory) -> np.ndarray:
        """Return the quasi-Newton step (n,)."""
        secant, rest = history.split
        length, known = norm(rest), norm(secant)
        return secant + min(1.0, max(MAX_BLIND_STEP, known) / length if length else 1.0) * rest
