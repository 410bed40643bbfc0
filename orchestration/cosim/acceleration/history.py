"""What an acceleration method knows: guesses and residuals of the macro step, and what it keeps between steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from .past_solutions import PastSolutions
from .secants import Secants, norm

__all__ = ["MAX_BLIND_STEP", "IterationHistory", "Method", "first_step", "no_jacobian"]

# Step limit in directions without secant information, in nominals: just long enough to learn from, since the gain of
# the loop may be anything.
MAX_BLIND_STEP = 0.02


def no_jacobian() -> None:
    """Return None: the Jacobian is not known."""


class IterationHistory:
    """Iterates of a loop with n unknowns, in units of the nominals.

    Attributes
    ----------
    x, r : list of ndarray, shape (n,)
        Guesses and residuals of the present macro step.
    secants : Secants
        Kept over macro steps.
    split : tuple of ndarray, shape (n,)
        secants.split() of the newest residual.
    memory : Any
        What the method itself keeps over macro steps.
    jacobian : callable
        Returns dr/dx (n, n) at the end of the last sweep, or None where it is not known.
    solutions : PastSolutions
        Of the last macro steps, in their own units.
    """

    def __init__(self, n: int) -> None:
        self._size = n
        self.solutions = PastSolutions()
        self.forget()

    def forget(self) -> None:
        """Discard all that is in units of the nominals, because these have changed."""
        self.x: list[np.ndarray] = []
        self.r: list[np.ndarray] = []
        self.secants = Secants(self._size)
        self.split: tuple[np.ndarray, np.ndarray] = (np.zeros(self._size), np.zeros(self._size))
        self.memory: Any = None
        self.jacobian: Callable[[], np.ndarray | None] = no_jacobian

    def start_step(self, jacobian: Callable[[], np.ndarray | None]) -> None:
        """Begin a macro step: residuals of the one before cannot be compared with its own."""
        self.x.clear()
        self.r.clear()
        self.jacobian = jacobian


class Method(Protocol):
    """An acceleration method."""

    def update(self, history: IterationHistory) -> np.ndarray:
        """Return the change (n,) of the guess after the newest residual, in units of the nominals."""


def first_step(omega: float, r: np.ndarray) -> np.ndarray:
    """Return omega r, no longer than MAX_BLIND_STEP: nothing is known of the loop yet."""
    length = omega * norm(r)
    return omega * r * min(1.0, MAX_BLIND_STEP / length if length else 1.0)
