"""First guess of a loop's unknowns, from polynomials through the solutions of the last macro steps.

The degree is the one that would have guessed the newest solution best from those before it. Where the unknowns are
smooth, as between events, a quartic guesses so well that most steps need one sweep.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .secants import norm

__all__ = ["KEPT", "LEAST", "PastSolutions"]

KEPT = 6  # solutions: five for a quartic, and one before them to see how well it guesses the newest
LEAST = 3  # solutions that a guess needs: those of a parabola


class PastSolutions:
    """Solutions (n,) of a loop, from old to new.

    Attributes
    ----------
    times : list of float
        Their times [s].
    values : list of ndarray, shape (n,)
        The solutions, in their own units.
    """

    def __init__(self) -> None:
        self.times: list[float] = []
        self.values: list[np.ndarray] = []

    def begin_step(self, time: float, start: np.ndarray) -> None:
        """Keep what leads to the start of a step: its time [s] and the values (n,) of the unknowns there.

        Later solutions were taken back. Where none is of this time, as after an event, there is no past.
        """
        while self.times and self.times[-1] > time:
            self.times.pop()
            self.values.pop()
        if not self.times or self.times[-1] != time:
            self.times, self.values = [time], [start]

    def add(self, time: float, solution: np.ndarray) -> None:
        """Append the solution (n,) at `time` [s]; the oldest is dropped."""
        self.times = [*self.times[1 - KEPT :], time]
        self.values = [*self.values[1 - KEPT :], solution]

    def guess(self, time: float, scale: np.ndarray) -> np.ndarray | None:
        """Return the unknowns (n,) at `time` [s], None where there are too few solutions; scale (n,): nominals."""
        count = len(self.times)
        if count < LEAST:
            return None
        degree, least = 2, np.inf
        for each in range(1, count - 1) if count > LEAST else ():
            miss = self._extrapolated(count - 2 - each, count - 1, self.times[-1]) - self.values[-1]
            error = norm(miss / scale)
            if error < least:
                degree, least = each, error
        return self._extrapolated(count - 1 - degree, count, time)

    def _extrapolated(self, first: int, end: int, time: float) -> np.ndarray:
        """Return the polynomial through the solutions first to end - 1 at `time` [s], by Lagrange's formula."""
        values = np.zeros_like(self.values[0])
        for weight, value in zip(_weights(self.times[first:end], time), self.values[first:end], strict=True):
            values = values + weight * value
        return values


def _weights(times: Sequence[float], t: float) -> list[float]:
    weights = []
    for k, own in enumerate(times):
        weight = 1.0
        for j, other in enumerate(times):
            if j != k:
                weight *= (t - other) / (own - other)
        weights.append(weight)
    return weights
