"""Comparison of two results: how far they lie apart, quantity by quantity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Difference", "compare"]

TIME_RTOL = 1e-9  # share of the last time within which two times are the same: rounding of sums of steps


@dataclass(frozen=True)
class Difference:
    """Difference of one quantity over its elements and the common times, in `unit`."""

    name: str
    unit: str
    most: float
    rms: float
    time: float  # of the largest one [s]
    span: float  # of the quantity itself: largest minus smallest value


def compare(a: xr.Dataset, b: xr.Dataset) -> tuple[Difference, ...]:
    """Compare every quantity that both results have at the times that both have.

    Angles (unit rad) differ modulo a turn. The log of the coupling and texts are left out. Memory is linear in the
    number of rows.

    Raises
    ------
    ValueError
        No quantity or no time is common, or the shapes or units of one differ.
    """
    names = [str(n) for n in a.data_vars if n in b.data_vars and _comparable(str(n), a, b)]
    times = a["time"].to_numpy()
    rows_a, rows_b = _common_rows(times, b["time"].to_numpy())
    if not names or not rows_a.size:
        raise ValueError("nothing to compare: no quantity or no time is in both; run both on one scene and grid")
    differences = []
    for name in names:
        units = [x[name].attrs.get("units", "1") for x in (a, b)]
        shapes = [x[name].shape[1:] for x in (a, b)]
        if shapes[0] != shapes[1] or units[0] != units[1]:
            raise ValueError(f"{name}: {shapes[0]} in {units[0]} against {shapes[1]} in {units[1]}")
        values, others = (x[name].to_numpy()[rows].astype(float) for x, rows in ((a, rows_a), (b, rows_b)))
        gap = values - others
        if units[0] == "rad":
            gap = (gap + np.pi) % (2 * np.pi) - np.pi
        largest = np.abs(gap).reshape(len(gap), -1).max(axis=1)
        time = float(times[rows_a][largest.argmax()])
        rms = float(np.sqrt((gap**2).mean()))
        differences.append(Difference(name, units[0], float(largest.max()), rms, time, float(np.ptp(values))))
    return tuple(differences)


def _comparable(name: str, a: xr.Dataset, b: xr.Dataset) -> bool:
    numbers = all(x[name].dtype.kind in "biuf" for x in (a, b))
    return numbers and not name.startswith("coupling.")


def _common_rows(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows of two increasing grids (n,), (m,) that have the same time.

    The rows of the first that have one, and for each the nearest row of the second.
    """
    if not first.size or not second.size:
        return np.zeros(0, dtype=int), np.zeros(0, dtype=int)
    after = np.clip(np.searchsorted(second, first), 1, max(second.size - 1, 1))
    before, after = np.minimum(after - 1, second.size - 1), np.minimum(after, second.size - 1)
    nearest = np.where(np.abs(first - second[before]) <= np.abs(first - second[after]), before, after)
    same = np.abs(first - second[nearest]) <= TIME_RTOL * max(abs(first[-1]), TIME_RTOL)
    return np.flatnonzero(same), nearest[same]
