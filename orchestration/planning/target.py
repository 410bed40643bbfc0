"""The path that a plan follows: outputs of the rod over time.

A CSV file has the time [s] in its first column and one output in each other, named rod.tip.p[1] or tip.p[1], with a
unit in brackets if it is not the output's own: tip.p[1] [mm]. Rows are joined by monotone cubics, so a few way points
give a smooth path without overshoot. Before the first row the manipulator approaches: no path is asked for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from ..errors import SceneError
from ..fmi.archive import similar
from ..scene import Scene
from ..scene.columns import column_names, column_signal, repeated
from .manipulator import rod_of

__all__ = ["Target", "read_target", "target_of"]

FARTHEST = 10.0  # nominals that a scale has at most: what is out of reach must not drown what can be gained


@dataclass(frozen=True)
class Target:
    """A wanted path.

    Attributes
    ----------
    times : ndarray, shape (K,)
        [s], increasing; the path is asked for from the first to the last.
    outputs : tuple of str
        Names of the rod's outputs, p of them.
    units : tuple of str
    values : ndarray, shape (K, p)
    nominals : tuple of float
        Typical sizes of the outputs.
    """

    times: np.ndarray
    outputs: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray
    nominals: tuple[float, ...]

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the path (k, p) at times (k,) [s]; before the first row its first point."""
        inside = np.clip(times, self.times[0], self.times[-1])
        return np.asarray(PchipInterpolator(self.times, self.values, axis=0)(inside))

    @cached_property
    def columns(self) -> dict[str, list[int]]:
        """Outputs of each unit."""
        return {unit: [k for k, u in enumerate(self.units) if u == unit] for unit in dict.fromkeys(self.units)}

    def distances(self, differences: np.ndarray) -> dict[str, np.ndarray]:
        """Return the distances (n,) from the path for differences (n, p), over the outputs of each unit."""
        return {unit: np.linalg.norm(differences[:, k], axis=1) for unit, k in self.columns.items()}

    @property
    def sizes(self) -> dict[str, float]:
        """Largest distance of the path from zero, over the outputs of each unit, or their nominal where it is zero."""
        sizes = self.distances(self.values)
        return {unit: float(size.max()) or self._nominal(unit) for unit, size in sizes.items()}

    @cached_property
    def scales(self) -> np.ndarray:
        """Sizes (p,) in which errors of the outputs are weighed against each other, the same for all of one unit.

        With one unit half the largest range of an output, or its size where it stands still. With several, the same
        multiple of each unit's nominal. A path that is far out of reach weighs no less for it: FARTHEST.
        """
        shares = [self._share(columns) / self._nominal(unit) for unit, columns in self.columns.items()]
        share = min(max(shares) or 1.0, FARTHEST)
        scales = np.empty(len(self.outputs))
        for unit, columns in self.columns.items():
            alone = self._share(columns) if len(self.columns) == 1 else 0.0
            scales[columns] = alone if 0.0 < alone <= FARTHEST * self._nominal(unit) else share * self._nominal(unit)
        return scales

    def _share(self, columns: list[int]) -> float:
        values = self.values[:, columns]
        return float(0.5 * np.ptp(values, axis=0).max()) or float(np.abs(values).max())

    def _nominal(self, unit: str) -> float:
        return max(self.nominals[k] for k in self.columns[unit])


def target_of(scene: Scene, times: Sequence[float], paths: Mapping[str, Sequence[float]]) -> Target:
    """Return the path with these values (K,) of each output at times (K,) [s], in the outputs' own units.

    Raises
    ------
    SceneError
        An output that the rod does not have, times that do not increase, or numbers that do not fit.
    """
    try:
        when = np.asarray(times, dtype=float)
        values = np.array([np.asarray(v, dtype=float) for v in paths.values()]).T
    except (TypeError, ValueError) as error:
        raise SceneError(f"path: {error}; give numbers, as many for each output as times") from error
    if when.ndim != 1 or when.size < 2 or values.shape != (when.size, len(paths)) or not len(paths):
        raise SceneError("a path needs two times at least, and as many values of each output; give more rows")
    _require_increasing(when)
    for name, column in zip(paths, values.T, strict=True):
        if not np.isfinite(column).all():
            row = int(np.argmin(np.isfinite(column)))
            raise SceneError(f"path of {name!r}: {column[row]:g} at t = {when[row]:g} s; give finite numbers")
    names = tuple(_output(scene, name) for name in paths)
    twice = repeated(names)
    if twice is not None:
        raise SceneError(f"a path of {twice!r} is given twice; keep one")
    variables = rod_of(scene).archive.variables
    units, nominals = ([getattr(variables[name], what) for name in names] for what in ("unit", "nominal"))
    return Target(when, names, tuple(units), values, tuple(nominals))


def _require_increasing(times: np.ndarray) -> None:
    """Raise SceneError unless times are finite, at 0 s or later, and increase."""
    before = np.concatenate([[-np.inf], times[:-1]])
    wrong = ~np.isfinite(times) | (times < 0.0) | (times <= before)
    if wrong.any():
        row = int(np.argmax(wrong))
        after = f" after {before[row]:g} s" if row and times[row] >= 0.0 else ""
        raise SceneError(
            f"path: time {times[row]:g} s in row {row + 1}{after}; give finite times that increase, from 0 s or later"
        )


def read_target(scene: Scene, path: Path) -> Target:
    """Read a path from a CSV file. Raises SceneError."""
    try:
        names = column_names(path)
        if len(names) < 2:
            raise ValueError(f"{path}: one column; give the time and an output at least")
        twice = repeated(names)
        if twice is not None:
            raise ValueError(f"{path}: two columns {twice!r}; keep one of them")
        variables = rod_of(scene).archive.variables
        times, paths = None, {}
        for name in names[1:]:
            variable = variables[_output(scene, name)]
            signal = column_signal({"file": path.name, "column": name}, path.parent, variable)
            times, paths[name] = signal.times, signal.values  # type: ignore[attr-defined]
        assert times is not None
        return target_of(scene, times, paths)
    except ValueError as error:
        raise SceneError(f"{error}") from error
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from error


def _output(scene: Scene, name: str) -> str:
    """Return the name of the rod's output without that of the member."""
    member = rod_of(scene)
    short = name.removeprefix(f"{member.name}.")
    outputs = [v.name for v in member.archive.variables.values() if v.causality == "output" and not v.discrete]
    if short not in outputs:
        raise SceneError(
            f"path of {name!r}: the rod has no such output; name the columns after outputs, such as tip.p[1] for the "
            f"tip's x; {similar(short, outputs)}"
        )
    return short
