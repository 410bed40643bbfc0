"""How far two runs lie apart in what a scene asks for: rms over the common times of the distance, share of the
quantity's range. The range is the diagonal of the box that the quantity moves in; one that hardly moves is measured
by a share of its nominal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import SceneError
from ...scene import Scene

__all__ = ["DEFAULT", "Course", "Quantity", "error", "quantities"]

DEFAULT = ("rod", "tip.p")  # model and output that a scene asks for where it does not say
_RESTING = 1e-3  # share of the nominal that counts as range, at least
_SAME = 1e-9  # share of the last time within which two are the same


@dataclass(frozen=True)
class Quantity:
    """An output of a member; least: the range that it has at least, in its unit; angle: the same again after 2 pi."""

    member: str
    elements: tuple[str, ...]  # variables
    least: float
    angle: bool = False


@dataclass(frozen=True)
class Course:
    """What a run gave of the quantities asked for."""

    times: np.ndarray  # [s]
    values: Mapping[str, np.ndarray]  # (time, element)


def quantities(scene: Scene) -> dict[str, Quantity]:
    """What the scene asks for, by name. Raises SceneError."""
    names = scene.accuracy.quantities
    if not names:
        rod = scene.model(DEFAULT[0])
        if rod is None:
            raise SceneError(
                f"{scene.name}: asks for nothing, and has no {DEFAULT[0]}.fmu whose tip could be meant; "
                "set fidelity.quantities, such as ['thermal.T']"
            )
        names = (f"{rod.name}.{DEFAULT[1]}",)
    return {name: _quantity(scene, *name.split(".", 1)) for name in names}


def _quantity(scene: Scene, member: str, output: str) -> Quantity:
    archive = scene.member(member).archive
    elements = archive.vectors.get(output, (output,))
    about = archive.variables[elements[0]]
    return Quantity(member, elements, _RESTING * about.nominal, about.unit == "rad")


def error(course: Course, better: Course, asked: Mapping[str, Quantity]) -> float:
    """The largest of all quantities asked for."""
    a, b = course.times, better.times
    after = np.clip(np.searchsorted(b, a), 1, len(b) - 1)
    nearest = after - (a - b[after - 1] < b[after] - a)
    same = np.abs(a - b[nearest]) <= _SAME * b[-1]
    worst = 0.0
    for name, quantity in asked.items():
        span = float(np.linalg.norm(np.ptp(better.values[name], axis=0)))
        gap = course.values[name][same] - better.values[name][nearest[same]]
        if quantity.angle:
            gap = (gap + np.pi) % (2.0 * np.pi) - np.pi
        worst = max(worst, float(np.sqrt((gap**2).sum(axis=1).mean())) / max(span, quantity.least))
    return worst
