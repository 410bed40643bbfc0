"""Degree 3: the cubic through the two newest values and their time derivatives. One sample alone gives its tangent;
where the newest sample has no derivative (a guessed end value), the parabola through both values and the first
derivative."""

from __future__ import annotations

import numpy as np

from . import linear
from .sample import Sample

__all__ = ["fit"]


def fit(samples: tuple[Sample, ...], t: float) -> np.ndarray:
    a = samples[-2] if len(samples) > 1 else samples[-1]
    if a.rates is None:
        return linear.fit(samples, t)
    b = samples[-1]
    polynomial = np.zeros((4, a.values.size))
    s = t - a.time  # shift of the expansion point from a
    if b is a:
        polynomial[0] = a.values + s * a.rates
        polynomial[1] = a.rates
        return polynomial
    h = b.time - a.time
    mean = (b.values - a.values) / h
    # u = a + a' s + p s^2 + q s^3
    if b.rates is None:
        p, q = (mean - a.rates) / h, np.zeros_like(mean)
    else:
        q = (a.rates + b.rates - 2.0 * mean) / (h * h)
        p = (mean - a.rates) / h - q * h
    polynomial[0] = a.values + s * (a.rates + s * (p + s * q))
    polynomial[1] = a.rates + s * (2.0 * p + 3.0 * s * q)
    polynomial[2] = 2.0 * p + 6.0 * s * q
    polynomial[3] = 6.0 * q
    return polynomial
