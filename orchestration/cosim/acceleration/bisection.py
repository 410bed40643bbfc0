"""Bisection of a step of the guess along which the residual changes its sign, as across a kink of the response."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .history import IterationHistory

__all__ = ["bisected_step"]

BISECTED = 0.3  # ratio of residuals along a step that ends its bisection


def bisected_step(history: IterationHistory) -> Iterator[np.ndarray]:
    """Yield changes (n,) of the guess back to where the residual along the last step is small, if it changes sign."""
    step = history.x[-1] - history.x[-2]
    first, last = float(history.r[-2] @ step), float(history.r[-1] @ step)
    start, position, end = 0.0, 1.0, 1.0  # shares of the step
    while first * last < 0.0 and abs(along := float(history.r[-1] @ step)) > BISECTED * min(abs(first), abs(last)):
        start, end = (position, end) if along * first > 0.0 else (start, position)
        yield (0.5 * (start + end) - position) * step
        position = 0.5 * (start + end)
