"""What an iteration method may look at: the guesses and residuals of this macro step, and what it keeps between
steps."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from .secants import Secants

__all__ = ["Method", "Trace"]


class Trace:
    """x, r: guesses and residuals (n,) of the present macro step, in units of the nominals."""

    def __init__(self, n: int) -> None:
        self.x: list[np.ndarray] = []
        self.r: list[np.ndarray] = []
        self.secants = Secants(n)
        self.memory: Any = None  # the method's own, kept over macro steps

    def renew(self) -> None:
        """A new macro step: its residuals cannot be compared with those of the one before."""
        self.x.clear()
        self.r.clear()


class Method(Protocol):
    def update(self, trace: Trace) -> np.ndarray:
        """The change (n,) of the guess after the newest residual, in units of the nominals."""
