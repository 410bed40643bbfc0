"""What an iteration method may look at: the guesses and residuals of this macro step, and what it keeps between
steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from .secants import Secants, norm

__all__ = ["MAX_BLIND_STEP", "IterationHistory", "Method", "first_step"]

MAX_BLIND_STEP = (
    0.02  # longest step into the unknown, in nominals: just long enough to learn from, since the gain may be anything
)


class IterationHistory:
    """x, r: guesses and residuals (n,) of the present macro step, in units of the nominals."""

    def __init__(self, n: int) -> None:
        self.x: list[np.ndarray] = []
        self.r: list[np.ndarray] = []
        self.secants = Secants(n)
        self.split: tuple[np.ndarray, np.ndarray] = (np.zeros(n), np.zeros(n))  # secants.split of the newest residual
        self.memory: Any = None  # the method's own, kept over macro steps
        self.tangent: Callable[[], np.ndarray | None] = lambda: None  # dr/dx (n, n) where the last sweep left the loop

    def renew(self) -> None:
        """A new macro step: its residuals cannot be compared with those of the one before."""
        self.x.clear()
        self.r.clear()


class Method(Protocol):
    def update(self, trace: IterationHistory) -> np.ndarray:
        """The change (n,) of the guess after the newest residual, in units of the nominals."""


def first_step(omega: float, r: np.ndarray) -> np.ndarray:
    """omega r, where nothing is known of the loop no longer than MAX_BLIND_STEP."""
    length = omega * norm(r)
    return omega * r * min(1.0, MAX_BLIND_STEP / length if length else 1.0)
