"""IQN-ILS, the same as Anderson acceleration of depth n: x+ = G(x) + W c, c = argmin |r + V c| over at most n
filtered columns kept from step to step (secants.py). At most n + 1 updates for a linear loop, one where the columns
of earlier steps still hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .trace import Trace

__all__ = ["IQN"]


@dataclass(frozen=True)
class IQN:
    omega: float = 0.25  # relaxation while there is no column at all

    def update(self, trace: Trace) -> np.ndarray:
        r = trace.r[-1]
        return trace.secants.error(r) if trace.secants.columns else self.omega * r
