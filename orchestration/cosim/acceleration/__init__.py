"""Solving x = G(x) for the interface vector x, where one G is one sweep over the subsystems of a loop.

Every method is a small frozen value with one function, update(trace) -> change of x. This file drives them and
decides when to stop: on the estimated true error e = (I - S)^-1 r of the guess and e - r of what the sweep gave, not
on the residual, which for a loop gain -g is g + 1 times the error."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .aitken import Aitken
from .broyden import Broyden
from .fixed_point import Plain
from .history import IterationHistory, Method
from .newton import Newton, Tangent
from .quasi_newton import IQN
from .relaxation import Relaxed
from .secants import Secants, norm, spectral_radius

__all__ = ["METHODS", "IterationHistory", "Method", "Outcome", "Secants", "norm", "solve", "spectral_radius"]

METHODS: dict[str, type] = {
    "plain": Plain,
    "relaxed": Relaxed,
    "aitken": Aitken,
    "iqn": IQN,
    "broyden": Broyden,
    "newton": Newton,
    "tangent": Tangent,
}

BLIND = 1e-3  # share of the tolerance that a residual must meet before any secant tells the loop's gain


@dataclass(frozen=True)
class Outcome:
    """x: the last guess, which the subsystems now hold; error: estimated Euclidean norm of its error, in units of the
    nominals, as the residuals are."""

    x: np.ndarray
    converged: bool
    error: float
    residuals: tuple[float, ...]


def solve(
    sweep: Callable[[np.ndarray], np.ndarray],
    x: np.ndarray,
    scale: np.ndarray,
    method: Method,
    trace: IterationHistory,
    tolerance: float,
    limit: int,
) -> Outcome:
    """Iterates from x (n,) until the estimated error is within tolerance * scale, for at most `limit` sweeps."""
    trace.renew()
    residuals: list[float] = []
    while True:
        r = (sweep(x) - x) / scale
        residuals.append(norm(r))
        if not residuals[-1] < math.inf:  # nan or infinite
            return Outcome(x, False, math.inf, tuple(residuals))
        trace.x.append(x / scale)
        trace.r.append(r)
        secants = trace.secants
        if len(residuals) > 1:
            dx = trace.x[-1] - trace.x[-2]
            if norm(dx) > 0.01 * tolerance:  # smaller differences are noise of the subsystems' solvers
                secants.add(dx, r - trace.r[-2])
        trace.split = secants.split(r)
        e = trace.split[0] + trace.split[1]
        error = max(norm(e), norm(e - r))
        if error <= (tolerance if secants.columns else BLIND * tolerance):
            return Outcome(x, True, error, tuple(residuals))
        if len(residuals) >= limit:
            return Outcome(x, False, error, tuple(residuals))
        x = x + scale * method.update(trace)
