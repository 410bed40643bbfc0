"""Measured curves beside computed ones: samples from a CSV file, in the units of a result.

The first column is the time. Each other column is named as a variable of the result, thermal.T[1] or rod.tip.p[3], with
a unit in brackets if it is not the result's own. An empty cell is a missing sample.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from ..errors import CosimError
from ..fmi.archive import Variable, similar
from ..results.dataset import scalars
from ..scene.columns import convert_column, read_samples

__all__ = ["Deviation", "Measured", "check_file", "read_measured"]


@dataclass(frozen=True)
class Deviation:
    """Difference of the computed curve from samples of one quantity, in the result's unit."""

    name: str
    unit: str
    samples: int  # within the time of the result
    rms: float
    most: float  # the largest
    time: float  # of the largest [s]


@dataclass(frozen=True)
class Measured:
    """Samples over time.

    Attributes
    ----------
    file : str
        Name of the file that they are from.
    times : ndarray, shape (n,)
        [s], increasing.
    values : mapping
        'member.variable[i]' -> samples (n,) in the result's unit, nan where missing.
    """

    file: str
    times: np.ndarray
    values: Mapping[str, np.ndarray]

    def samples(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Times [s] and values of the samples of a quantity that are there."""
        known = np.isfinite(self.values[name])
        return self.times[known], self.values[name][known]

    def deviations(self, result: xr.Dataset) -> Iterator[Deviation]:
        """Compare the result, interpolated linearly, with the samples within its time."""
        computed, course = scalars(result), result["time"].to_numpy()
        for name in self.values:
            times, values = self.samples(name)
            inside = (times >= course[0]) & (times <= course[-1])
            curve, unit = computed[name]
            gaps = np.interp(times[inside], course, curve) - values[inside]
            worst = int(np.abs(gaps).argmax())
            yield Deviation(
                name,
                unit,
                int(inside.sum()),
                float(np.sqrt(np.mean(gaps**2))),
                float(abs(gaps[worst])),
                float(times[inside][worst]),
            )


def check_file(path: Path) -> None:
    """Raise CosimError where a file cannot be read as samples, before anything is run."""
    try:
        read_samples(path)
    except ValueError as error:
        raise CosimError(str(error)) from error


def read_measured(path: Path, result: xr.Dataset) -> Measured:
    """Read samples of quantities of a result.

    Raises
    ------
    CosimError
        A file that cannot be read, times that do not increase, a column that names nothing in the result, a unit that
        does not fit, or no sample within the time of the result.
    """
    computed = scalars(result)
    values = {}
    try:
        heads, (times, *columns) = read_samples(path)
        if not all(a < b for a, b in itertools.pairwise(times)):
            raise ValueError(f"{path}: times must increase; sort the rows, one for each time, none without a time")
        if not columns:
            raise ValueError(f"{path}: no column beside the time; add one, named as a variable: rod.tip.p[1] [mm]")
        for (name, unit), column in zip(heads[1:], columns, strict=True):
            if name not in computed:
                raise ValueError(f"{path}: column {name!r}: not in the result; {similar(name, list(computed))}")
            own = computed[name][1]
            variable = Variable(name, 0, "Real", "output", "continuous", "", own, {} if own == "1" else None)
            values[name] = np.array(convert_column(column, unit, variable, path))
    except ValueError as error:
        raise CosimError(str(error)) from error
    measured = Measured(path.name, np.array(times), values)
    first, last = (float(result["time"][k]) for k in (0, -1))
    for name in values:
        at, _ = measured.samples(name)
        if not ((at >= first) & (at <= last)).any():
            raise CosimError(
                f"{path}: column {name!r}: no sample from t = {first:g} s to {last:g} s, the time of the result; "
                "shift the times, or run the scene longer"
            )
    return measured
