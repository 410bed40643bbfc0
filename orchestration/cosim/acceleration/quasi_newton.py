"""IQN-ILS, the same as Anderson acceleration of depth n: the secant step over at most n filtered columns kept from
macro step to macro step (secants.py), and a short plain step in the directions of which no column tells anything
yet, no longer than the secant step or MAX_BLIND_STEP. At most n + 1 updates for a linear loop,
one where the columns of earlier steps still hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .history import MAX_BLIND_STEP, IterationHistory
from .secants import norm

__all__ = ["IQN"]


@dataclass(frozen=True)
class IQN:
    def update(self, trace: IterationHistory) -> np.ndarray:
        secant, rest = trace.split
        length, known = norm(rest), norm(secant)
        return secant + min(1.0, max(MAX_BLIND_STEP, known) / length if length else 1.0) * rest
