"""Reference solution of a chart: the monolith, refined in space and time, at two levels.

The difference between the two is the floor below which measured errors have no meaning.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...scene import read
from ...verification import monolith

__all__ = ["LEVELS", "solve_reference"]

LEVELS = ("coarse", "fine")  # keys of [reference] in a file of series


def solve_reference(
    source: str,
    overrides: Sequence[str],
    times: np.ndarray,
    level: Mapping[str, Any],
    progress: Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Solve one level: its `set` are overrides of the scene, `tolerance` is that of the integrator.

    progress is called with the share done.
    """
    at_time = (lambda time: progress(time / times[-1])) if progress else (lambda time: None)
    return monolith.solve_monolith(read(source, [*overrides, *level["set"]]), level["tolerance"], times, at_time)
