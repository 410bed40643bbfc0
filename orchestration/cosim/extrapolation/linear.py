"""Degree 1: the line through the two newest values."""

from __future__ import annotations

import numpy as np

from . import held
from .sample import Sample

__all__ = ["fit"]


def fit(samples: tuple[Sample, ...], t: float) -> np.ndarray:
    if len(samples) < 2:
        return held.fit(samples, t)
    a, b = samples[-2:]
    polynomial = np.zeros((4, a.values.size))
    polynomial[1] = slope = (b.values - a.values) / (b.time - a.time)
    polynomial[0] = a.values + slope * (t - a.time)
    return polynomial
