"""The path that a plan follows: outputs of the rod over time.

A CSV file has the time [s] in its first column and one output in each other, named rod.tip.p[1] or tip.p[1], with a
unit in brackets if it is not the output's own: tip.p[1] [mm]. Rows are joined by monotone cubics, so a few way points
give a smooth path without overshoot. Before the first row the manipulator approaches: no path is asked for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from ..errors import SceneError
from ..fmi.archive import similar
from ..scene import Scene
from ..scene.columns import column_names, column_signal, repeated
from .manipulator import rod_of

__all__ = ["Target", "read_target", "target_of"]


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
    """

    times: np.ndarray
    outputs: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the path (k, p) at times (k,) [s]; before the first row its first point."""
        inside = np.clip(times, self.times[0], self.times[-1])
        return np.asarray(PchipInterpolator(self.times, self.values, axis=0)(inside))

    @property
    def size(self) -> float:
        """Largest distance of the path from zero, over the outputs."""
        return float(np.linalg.norm(self.values, axis=1).max())

    @property
    def scale(self) -> float:
        """Size of the path: half the largest range of an output, or its nominal where it stands still."""
        ranges = np.ptp(self.values, axis=0)
        return float(0.5 * ranges.max()) or float(np.abs(self.values).max()) or 1.0


def target_of(scene: Scene, times: Sequence[float], paths: Mapping[str, Sequence[float]]) -> Target:
    """Return the path with these values (K,) of each output at times (K,) [s], in the outputs' own units.

    Raises
    ------
    SceneError
        An output that the rod does not have, times that do not increase, or numbers that do not fit.
    """
    when = np.asarray(times, dtype=float)
    values = np.array([np.asarray(v, dtype=float) for v in paths.values()]).T
    if when.ndim != 1 or when.size < 2 or values.shape != (when.size, len(paths)) or not len(paths):
        raise SceneError("a path needs two times at least, and as many values of each output")
    if not (np.isfinite(when).all() and np.isfinite(values).all() and (np.diff(when) > 0.0).all() and when[0] >= 0.0):
        raise SceneError("times of a path must be finite and increase from 0 s or later, its values be finite")
    names = tuple(_output(scene, name) for name in paths)
    twice = repeated(names)
    if twice is not None:
        raise SceneError(f"a path of {twice!r} is given twice; keep one")
    variables = rod_of(scene).archive.variables
    return Target(when, names, tuple(variables[name].unit for name in names), values)


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
    except ValueError as error:
        raise SceneError(f"{error}") from error
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from error
    assert times is not None
    return target_of(scene, times, paths)


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
