"""The error of a run, and which runs none beats.

error = sqrt(mean over quantities, elements and times of ((y - y_true)/range)^2); the range of a quantity is that of
its element that varies most, over the output times; the start is left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from ...errors import CosimError

__all__ = ["AXIS", "QUANTITIES", "Norm", "front", "sampled"]

QUANTITIES = {"thermal.T": 300.0, "rod.delta": 1e-3, "rod.tip.p": 1e-2}  # and their nominals [K, m, m]
STILL = 1e-6  # share of the nominal: what varies less is left out
SAME = 1e-9  # share of the course below which two times are the same
AXIS = "error: RMS over {n} times of {names}, each over its range [1]"


@dataclass(frozen=True)
class Norm:
    """times (n,) [s]; truth: per quantity (n, elements); ranges: per quantity, in its unit."""

    times: np.ndarray
    truth: dict[str, np.ndarray]
    ranges: dict[str, float]

    @classmethod
    def of(cls, truth: xr.Dataset, times: np.ndarray) -> Norm:
        """Raises CosimError where nothing varies."""
        courses = {name: sampled(truth, name, times) for name in QUANTITIES if name in truth}
        ranges = {name: float(np.ptp(values, axis=0).max()) for name, values in courses.items()}
        moving = {name: span for name, span in ranges.items() if span > STILL * QUANTITIES[name]}
        if not moving:
            raise CosimError(f"chart: none of {', '.join(QUANTITIES)} varies in this scene; drive or load it")
        return cls(times, {name: courses[name] for name in moving}, moving)

    def error(self, result: xr.Dataset) -> float:
        """Raises CosimError where an output time is missing."""
        squares = [
            np.square((sampled(result, name, self.times) - truth) / self.ranges[name])[1:]
            for name, truth in self.truth.items()
        ]
        return float(np.sqrt(np.mean(np.concatenate(squares, axis=1))))

    def axis(self) -> str:
        return AXIS.format(n=self.times.size - 1, names=", ".join(name.partition(".")[2] for name in self.truth))


def sampled(result: xr.Dataset, name: str, times: np.ndarray) -> np.ndarray:
    """(n, elements) at the times, which must be among those of the result."""
    there = result["time"].to_numpy()
    nearest = np.abs(there[:, None] - times).argmin(axis=0)
    missing = np.abs(there[nearest] - times) > SAME * times[-1]
    if missing.any():
        raise CosimError(f"chart: {name} has no value at t = {times[missing][0]:.6g} s; choose other outputs")
    return result[name].to_numpy()[nearest].reshape(times.size, -1)


def front(errors: np.ndarray, costs: np.ndarray) -> np.ndarray:
    """(n,) bool: finite, and no other has both no larger error and no larger cost, one of them smaller."""
    good = np.isfinite(errors) & np.isfinite(costs)
    no_better = (errors[:, None] >= errors) & (costs[:, None] >= costs)
    worse = no_better & ((errors[:, None] > errors) | (costs[:, None] > costs))
    return good & ~(worse & good).any(axis=1)
