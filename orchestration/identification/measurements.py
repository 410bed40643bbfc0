"""Measured outputs over time.

A CSV file has the time [s] in its first column and an output in each other, named as in a scene, thermal.T[1] or
rod.tip.p[2], with a unit in brackets if it is not the output's own: thermal.T[1] [degC]. An empty cell is a missing
sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import SceneError
from ..fmi.archive import Variable, similar
from ..scene import Scene
from ..scene.columns import convert_column, read_samples

__all__ = ["Measurements", "measurements_of", "read_measurements"]


@dataclass(frozen=True)
class Measurements:
    """Samples of outputs.

    Attributes
    ----------
    times : ndarray, shape (n,)
        [s], increasing.
    outputs : tuple of str
        'member.output' of each of m columns.
    values : ndarray, shape (n, m)
        In the outputs' own units; nan where a sample is missing.
    """

    times: np.ndarray
    outputs: tuple[str, ...]
    values: np.ndarray


def measurements_of(
    scene: Scene, times: Sequence[float] | np.ndarray, values: Mapping[str, Sequence[float] | np.ndarray]
) -> Measurements:
    """Return measurements of a scene: output -> values (n,), nan where missing, at times (n,) [s].

    Raises
    ------
    SceneError
        An output that the scene does not have, times outside of it, or no sample at all.
    """
    when = np.asarray(times, dtype=float)
    if not values or when.ndim != 1 or not when.size:
        raise SceneError("measurements need times, and an output at least; give them")
    wrong = ~np.isfinite(when) | np.concatenate([[False], np.diff(when) <= 0.0])
    if wrong.any():
        row = int(np.argmax(wrong))
        after = f" after {when[row - 1]:g} s" if row and np.isfinite(when[row]) else ""
        raise SceneError(f"measurements: time {when[row]:g} s in row {row + 1}{after}; give finite times that increase")
    if when[0] < scene.start_time or when[-1] > scene.stop_time * (1.0 + 1e-12):
        raise SceneError(
            f"measurements from {when[0]:g} s to {when[-1]:g} s: the scene runs from {scene.start_time:g} s to "
            f"{scene.stop_time:g} s; set stop_time"
        )
    for name in values:
        _output(scene, name)
    try:
        table = np.array([np.asarray(column, dtype=float) for column in values.values()]).T
    except (TypeError, ValueError) as error:
        raise SceneError(f"measurements: {error}; give numbers, as many of each output as times") from error
    if table.shape != (when.size, len(values)) or np.isinf(table).any():
        raise SceneError("measurements need as many values of each output as times, finite or missing (nan)")
    for name, column in zip(values, table.T, strict=True):
        if np.isnan(column).all():
            raise SceneError(f"measurements of {name!r}: the column has no sample; leave it out")
    return Measurements(when, tuple(values), table)


def read_measurements(scene: Scene, path: Path) -> Measurements:
    """Read measurements from a CSV file. Raises SceneError."""
    values = {}
    try:
        heads, (times, *columns) = read_samples(path)
        for (name, unit), column in zip(heads[1:], columns, strict=True):
            values[name] = np.array(convert_column(column, unit, _output(scene, name), path))
        return measurements_of(scene, np.array(times), values)
    except ValueError as error:
        raise SceneError(f"{error}") from error
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from error


def _output(scene: Scene, name: str) -> Variable:
    member, _, variable = name.partition(".")
    owner = next((m for m in scene.members if m.name == member), None)
    if owner is None:
        raise SceneError(
            f"measurements of {name!r}: no FMU {member!r}; name the columns after outputs of the scene's FMUs "
            f"({', '.join(m.name for m in scene.members)}), such as rod.tip.p[1]"
        )
    outputs = [v.name for v in owner.archive.variables.values() if v.causality == "output" and not v.discrete]
    if variable not in outputs:
        raise SceneError(f"measurements of {name!r}: no such output; {similar(variable, outputs)}")
    return owner.archive.variables[variable]
