"""What errors are measured against: the monolith, refined in space and time, at two tolerances. The gap between the two
is the floor below which errors mean nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...scene import read
from ...verification import monolith

__all__ = ["LEVELS", "solve"]

LEVELS = ("coarse", "fine")  # keys of [truth]


def solve(
    source: str,
    overrides: Sequence[str],
    times: np.ndarray,
    level: Mapping[str, Any],
    progress: Callable[[float], None] | None = None,
) -> xr.Dataset:
    """level: `set`, overrides of the scene, and `tolerance` of the integrator. progress(share done)."""
    told = (lambda time: progress(time / times[-1])) if progress else (lambda time: None)
    return monolith.solve_monolith(read(source, [*overrides, *level["set"]]), level["tolerance"], times, told)
