"""How far two results lie apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

__all__ = ["Difference", "compare"]


@dataclass(frozen=True)
class Difference:
    """Of one quantity, over its elements and the common times, in `unit`."""

    name: str
    unit: str
    most: float
    rms: float
    time: float  # of the largest one [s]
    span: float  # of the quantity itself: largest minus smallest value


def compare(a: xr.Dataset, b: xr.Dataset) -> tuple[Difference, ...]:
    """Every quantity that both have, but the coupling's log, at the times that both have. Angles differ modulo a turn.
    ValueError where nothing is common, shapes or units differ."""
    names = [str(n) for n in a.data_vars if n in b.data_vars and not str(n).startswith("coupling.")]
    first, second = a["time"].to_numpy(), b["time"].to_numpy()
    nearest = np.abs(first[:, None] - second).argmin(axis=1)
    same = np.abs(first - second[nearest]) <= 1e-9 * max(abs(first[-1]), 1e-9)
    if not names or not same.any():
        raise ValueError("nothing to compare: no quantity or no time is in both; run both on one scene and grid")
    found = []
    for name in names:
        one, other = a[name].to_numpy()[same], b[name].to_numpy()[nearest[same]]
        units = [x[name].attrs.get("units", "1") for x in (a, b)]
        if one.shape != other.shape or units[0] != units[1]:
            raise ValueError(f"{name}: {one.shape} in {units[0]} against {other.shape} in {units[1]}")
        gap = one - other
        if units[0] == "rad":
            gap = (gap + np.pi) % (2 * np.pi) - np.pi
        flat = np.abs(gap).reshape(len(gap), -1)
        at = float(first[same][flat.max(axis=1).argmax()])
        rms = float(np.sqrt((flat**2).mean()))
        found.append(Difference(name, units[0], float(flat.max()), rms, at, float(np.ptp(one))))
    return tuple(found)
