"""A polynomial c0 + c1 s + c2 s^2/2 + c3 s^3/6, rows of c (4, n), seen from elsewhere."""

from __future__ import annotations

import numpy as np

__all__ = ["powers", "shift"]


def powers(s: float) -> np.ndarray:
    """(4,): powers(s) @ c are the values s further, powers(s)[:3] @ c[1:] the slopes there."""
    return np.array((1.0, s, s * s / 2.0, s * s * s / 6.0))


def shift(s: float) -> np.ndarray:
    """(4, 4): shift(s) @ c is the same polynomial expanded s further."""
    _, s, square, cube = powers(s)
    return np.array(((1.0, s, square, cube), (0.0, 1.0, s, square), (0.0, 0.0, 1.0, s), (0.0, 0.0, 0.0, 1.0)))
