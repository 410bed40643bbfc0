"""Degree 3: the cubic through the two newest values and their time derivatives. One sample alone gives its tangent;
where the newest sample has no derivative (a guessed end value), the parabola through both values and the first
derivative."""

from __future__ import annotations

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
    h = b.time - a.time
    mean = (b.values - a.values) / h
    bend = mean - a.rates
    if b.rates is None:
        return np.array((a.values, a.rates, bend * (2.0 / h), np.zeros_like(bend)))
    twist = b.rates - mean - bend
    return np.array((a.values, a.rates, (bend - twist) * (2.0 / h), twist * (6.0 / (h * h))))
