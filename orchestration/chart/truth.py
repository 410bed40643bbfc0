"""What errors are measured against: the monolith, refined in space and time, at two tolerances. The gap between the two
is the floor below which errors mean nothing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from .. import monolith
from ..scene import Scene, read

__all__ = ["LEVELS", "output_times", "solve"]

LEVELS = ("coarse", "fine")  # keys of [truth]
MOST = 4  # times the least number of outputs, up to which one is looked for that meets all jumps


def output_times(scene: Scene, least: int) -> np.ndarray:
    """(n + 1,) from 0 to the stop time [s], evenly spaced, n >= least; if possible such that every jump of a signal
    falls on one, so that outputs cost no macro steps of their own."""
    signals = [signal for member in scene.members for signal in member.signals.values()]
    jumps = {t for signal in signals for t in signal.breaks if 0 < t < scene.stop_time}
    for count in range(least, MOST * least + 1):
        places = [t / scene.stop_time * count for t in jumps]
        if all(math.isclose(place, round(place), abs_tol=1e-9 * count) for place in places):
            return np.linspace(0.0, scene.stop_time, count + 1)
    return np.linspace(0.0, scene.stop_time, least + 1)


def solve(source: str, overrides: Sequence[str], times: np.ndarray, level: Mapping[str, Any]) -> xr.Dataset:
    """level: `set`, overrides of the scene, and `tolerance` of the integrator."""
    return monolith.run(read(source, [*overrides, *level["set"]]), level["tolerance"], times)
