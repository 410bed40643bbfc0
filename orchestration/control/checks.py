"""Checks of what a loop hands to observers and controllers: a number that is not one must not become a voltage."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..errors import SceneError

__all__ = ["require_numbers", "require_positive"]


def require_numbers(what: str, values: Sequence[float] | np.ndarray, count: int, missing: bool = False) -> np.ndarray:
    """Return values as an array (count,).

    Raises
    ------
    SceneError
        There are more or fewer, or some are not finite; nan is allowed where values may be missing.
    """
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise SceneError(f"{what}: {error}; give {count} numbers") from error
    if array.shape != (count,):
        raise SceneError(f"{what}: shape {array.shape}; give {count} numbers")
    if np.isinf(array).any() or (np.isnan(array).any() and not missing):
        raise SceneError(
            f"{what} = {array.tolist()}: give finite numbers" + (", or nan where one is missing" * missing)
        )
    return array


def require_positive(what: str, value: float) -> None:
    """Raise SceneError unless a number is positive and finite."""
    if not 0.0 < value < math.inf:
        raise SceneError(f"{what} = {value:g}: give a positive number")
