"""Degree 2: the parabola through the three newest values (Newton's divided differences, expanded at the newest).
Two samples give it with the derivative of the first in place of the third value, one its tangent."""

from __future__ import annotations

import numpy as np

from . import hermite
from .sample import Sample
from .taylor import shift

__all__ = ["fit"]


def fit(samples: tuple[Sample, ...], t: float) -> np.ndarray:
    if len(samples) < 3:
        return hermite.fit(tuple(s if s is samples[0] else s._replace(rates=None) for s in samples), t)
    a, b, c = samples[-3:]
    before, after = (b.values - a.values) / (b.time - a.time), (c.values - b.values) / (c.time - b.time)
    bend = (after - before) * (2.0 / (c.time - a.time))
    slope = after + bend * (0.5 * (c.time - b.time))  # at c
    polynomial = np.array((c.values, slope, bend, np.zeros_like(bend)))
    return polynomial if c.time == t else shift(t - c.time) @ polynomial
