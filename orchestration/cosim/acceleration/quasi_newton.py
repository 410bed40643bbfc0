"""IQN-ILS, the same as Anderson acceleration of depth n (Degroote 2009, Walker and Ni 2011), safeguarded at kinks.

The secant step over at most n filtered columns, kept from macro step to macro step (secants.py), plus a short fixed
point step in the directions that no column covers, no longer than the secant step or MAX_BLIND_STEP. A linear loop
takes at most n + 1 updates, one where the columns of earlier steps still hold.

Where the response bends, as at the onset of a contact, secants across the bend mislead: the guesses jump from one side
to the other, for as many sweeps as the slopes differ by. A macro step that is not solved when a linear loop would be
goes on with Newton's method, from differences at the guess itself and with Broyden's update while that contracts.
Newton's method may go too far once, as it does at first for a force that grows with the penetration ever faster; where
it does again it may cycle, and the step is bisected.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .bisection import bisected_step
from .history import MAX_BLIND_STEP, IterationHistory
from .secants import norm

__all__ = ["QuasiNewton"]

STALLED = 0.5  # ratio of the newest residual to the least before it from which on a step that takes long is not solved
CONTRACTION = 0.3  # ratio of residuals above which the Jacobian is formed anew: a kept one saves n sweeps
# Length of a difference [nominals], and its share of the last change of the guess: a bend is as near as that.
DIFFERENCE, DIFFERENCE_SHARE = 1e-5, 1e-3
LEAST_DIFFERENCE = 1e-7  # shorter ones show the noise of the subsystems' solvers


@dataclass(frozen=True)
class QuasiNewton:
    """IQN-ILS with columns of earlier macro steps."""

    def update(self, history: IterationHistory) -> np.ndarray:
        """Return the quasi-Newton step (n,). Raises LinAlgError."""
        if len(history.r) == 1:
            history.memory = None
        if history.memory is None and _is_stalled(history):
            history.memory = _safeguarded_steps(history)
        return _secant_step(history) if history.memory is None else next(history.memory)


def _secant_step(history: IterationHistory) -> np.ndarray:
    secant, rest = history.split
    length, known = norm(rest), norm(secant)
    return secant + min(1.0, max(MAX_BLIND_STEP, known) / length if length else 1.0) * rest


def _is_stalled(history: IterationHistory) -> bool:
    """Whether a linear loop would have been solved by now, and this one, whose residual has grown once, is not yet."""
    if len(history.r) <= history.r[-1].size + 2:
        return False
    *before, last = (norm(r) for r in history.r)
    return last > STALLED * min(before) and any(b > a for a, b in pairwise((*before, last)))


def _safeguarded_steps(history: IterationHistory) -> Iterator[np.ndarray]:
    """Yield changes (n,) of the guess, without an end; the newest residual is then that of the changed guess."""
    yield from _newton_steps(history)
    while True:
        yield from _newton_steps(history)
        if norm(history.r[-1]) > norm(history.r[-2]):
            yield from bisected_step(history)


def _newton_steps(history: IterationHistory) -> Iterator[np.ndarray]:
    """Yield n differences, the Newton step that they give, and more as long as these contract."""
    length = DIFFERENCE_SHARE * norm(history.x[-1] - history.x[-2])
    length = min(max(length, LEAST_DIFFERENCE), DIFFERENCE)
    columns = []
    for direction in np.eye(history.r[-1].size):
        yield length * direction
        columns.append((history.r[-1] - history.r[-2]) / length)
    jacobian = np.array(columns).T
    yield np.linalg.solve(jacobian, -history.r[-1])
    while norm(history.r[-1]) <= CONTRACTION * norm(history.r[-2]):
        dx, dr = history.x[-1] - history.x[-2], history.r[-1] - history.r[-2]
        jacobian = jacobian + np.outer(dr - jacobian @ dx, dx) / (dx @ dx)
        yield np.linalg.solve(jacobian, -history.r[-1])
