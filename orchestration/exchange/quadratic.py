"""Degree 2: the parabola through the three newest values (Newton's divided differences, expanded at t). Two samples
give it with the derivative of the first in place of the third value, one its tangent."""

from __future__ import annotations

import numpy as np

from . import hermite
from .sample import Sample

__all__ = ["fit"]


def fit(samples: tuple[Sample, ...], t: float) -> np.ndarray:
    if len(samples) < 3:
        return hermite.fit(tuple(s if s is samples[0] else s._replace(rates=None) for s in samples), t)
    a, b, c = samples[-3:]
    first = (b.values - a.values) / (b.time - a.time)
    second = ((c.values - b.values) / (c.time - b.time) - first) / (c.time - a.time)
    from_a, from_b = t - a.time, t - b.time
    polynomial = np.zeros((4, first.size))
    polynomial[0] = a.values + from_a * (first + from_b * second)
    polynomial[1] = first + (from_a + from_b) * second
    polynomial[2] = 2.0 * second
    return polynomial
