"""Error norm of a chart and its Pareto front.

error = sqrt(mean over quantities, elements and times of ((y - y_ref)/range)^2). The range of a quantity is that of its
element that varies most over the output times; the start is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from ...errors import CosimError

__all__ = ["AXIS", "QUANTITIES", "ErrorNorm", "pareto_front", "values_at"]

QUANTITIES = {"thermal.T": 300.0, "rod.delta": 1e-3, "rod.tip.p": 1e-2}  # and their nominals [K, m, m]
STILL = 1e-6  # share of the nominal; quantities that vary less are left out
SAME = 1e-9  # share of the stop time below which two times are equal
AXIS = "error: RMS over {n} times of {names}, each over its range [1]"


@dataclass(frozen=True)
class ErrorNorm:
    """The norm that errors of one scene are measured in.

    times: (n,) of the output [s]; reference: values (n, elements) of each quantity; ranges: of each quantity, in its
    unit.
    """

    times: np.ndarray
    reference: dict[str, np.ndarray]
    ranges: dict[str, float]

    @classmethod
    def from_reference(cls, reference: xr.Dataset, times: np.ndarray) -> ErrorNorm:
        """The norm of a reference result at the output times. Raises CosimError where nothing varies."""
        courses = {name: values_at(reference, name, times) for name in QUANTITIES if name in reference}
        ranges = {name: float(np.ptp(values, axis=0).max()) for name, values in courses.items()}
        moving = {name: span for name, span in ranges.items() if span > STILL * QUANTITIES[name]}
        if not moving:
            raise CosimError(f"chart: none of {', '.join(QUANTITIES)} varies in this scene; drive or load it")
        return cls(times, {name: courses[name] for name in moving}, moving)

    def error(self, result: xr.Dataset) -> float:
        """Error of a result. Raises CosimError where an output time is missing."""
        squares = [
            np.square((values_at(result, name, self.times) - reference) / self.ranges[name])[1:]
            for name, reference in self.reference.items()
        ]
        return float(np.sqrt(np.mean(np.concatenate(squares, axis=1))))

    def axis(self) -> str:
        """Label of the axis of errors."""
        return AXIS.format(n=self.times.size - 1, names=", ".join(name.partition(".")[2] for name in self.reference))


def values_at(result: xr.Dataset, name: str, times: np.ndarray) -> np.ndarray:
    """Values (n, elements) of a quantity at times that must be among those of the result, which ascend.

    Raises CosimError where a time is missing.
    """
    there = result["time"].to_numpy()
    right = np.clip(np.searchsorted(there, times), 0, there.size - 1)
    left = np.maximum(right - 1, 0)
    # Of two equally near times the first, also of equal ones.
    nearest = np.where(np.abs(there[left] - times) <= np.abs(there[right] - times), left, right)
    missing = np.abs(there[nearest] - times) > SAME * times[-1]
    if missing.any():
        raise CosimError(f"chart: {name} has no value at t = {times[missing][0]:.6g} s; choose other outputs")
    return result[name].to_numpy()[nearest].reshape(times.size, -1)


def pareto_front(errors: np.ndarray, costs: np.ndarray) -> np.ndarray:
    """Which of n points lie on the Pareto front: (n,) of bool.

    A point does where it is finite and no other has both no larger error and no larger cost, one of them smaller.
    """
    front = np.zeros(errors.size, dtype=bool)
    good = np.flatnonzero(np.isfinite(errors) & np.isfinite(costs))
    last = (np.inf, np.inf)  # error and cost of the last point on the front
    for k in good[np.lexsort((costs[good], errors[good]))]:
        point = (float(errors[k]), float(costs[k]))
        if point[1] < last[1] or point == last:
            front[k], last = True, point
    return front
