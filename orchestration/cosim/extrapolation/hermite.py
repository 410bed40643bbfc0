"""Degree 3: the cubic through the two newest values and their time derivatives. One sample alone gives its tangent;
where the newest sample has no derivative (a guessed end value), the parabola through both values and the first
derivative."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from . import linear
from .sample import Sample
from .taylor import shift

__all__ = ["fit"]


def fit(samples: tuple[Sample, ...], t: float) -> np.ndarray:
    a = samples[-2] if len(samples) > 1 else samples[-1]
    if a.rates is None:
        return linear.fit(samples, t)
    b = samples[-1]
    polynomial = _from(a, b)
    return polynomial if a.time == t else shift(t - a.time) @ polynomial


def _from(a: Sample, b: Sample) -> np.ndarray:
    """Expanded at a: the columns are few, so what counts is how few operations there are."""
    if b is a:
        zeros = np.zeros_like(a.values)
        return np.array((a.values, a.rates, zeros, zeros))
    h, rise = b.time - a.time, b.values - a.values
    if b.rates is None:
        return np.array((a.values, a.rates, (rise / h - a.rates) * (2.0 / h), np.zeros_like(rise)))
    cubic: np.ndarray = _weights(h).dot(np.array((a.values, a.rates, rise, b.rates)))
    return cubic


@lru_cache(maxsize=256)  # steps of one length ask again and again
def _weights(h: float) -> np.ndarray:
    """(4, 4): from value and rate at the start, rise over h [s] and rate at the end; of constants exactly null."""
    return np.array(
        (
            (1.0, 0.0, 0.0, 0.0),
            (0.0, 1.0, 0.0, 0.0),
            (0.0, -4.0 / h, 6.0 / h**2, -2.0 / h),
            (0.0, 6.0 / h**2, -12.0 / h**3, 6.0 / h**2),
        )
    )
