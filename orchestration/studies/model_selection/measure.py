"""Error of a run in the quantities that a scene asks for, relative to their ranges.

The error is the rms over the common times of the distance between two trajectories, divided by the range: the diagonal
of the box that the quantity moves in, at least a share of its nominal.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import SceneError
from ...scene import Scene

__all__ = ["DEFAULT", "Quantity", "Trajectory", "relative_error", "requested_quantities"]

DEFAULT = ("rod", "tip.p")  # model and output that a scene asks for where it says nothing
_LEAST_RANGE = 1e-3  # share of the nominal that counts as range, at least
_SAME_TIME = 1e-9  # share of the last time within which two times are equal


@dataclass(frozen=True)
class Quantity:
    """An output vector of a member.

    Parameters
    ----------
    member : str
        Name of the member.
    elements : tuple of str
        Names of the vector's scalar variables.
    least : float
        Smallest range that errors are divided by, in the quantity's unit.
    angle : bool
        Whether values that differ by 2 pi are equal.
    """

    member: str
    elements: tuple[str, ...]
    least: float
    angle: bool = False


@dataclass(frozen=True)
class Trajectory:
    """Values of the quantities asked for. times: (n,) [s]; values: per quantity (n, elements)."""

    times: np.ndarray
    values: Mapping[str, np.ndarray]


def requested_quantities(scene: Scene) -> dict[str, Quantity]:
    """The quantities that the scene asks for, by name. Raises SceneError where it asks for none and has no rod."""
    names = scene.accuracy.quantities
    if not names:
        rods = scene.models(DEFAULT[0])
        if not rods:
            raise SceneError(
                f"{scene.name}: asks for nothing, and has no {DEFAULT[0]}.fmu whose tip could be meant; "
                "set fidelity.quantities, such as ['thermal.T']"
            )
        names = tuple(f"{rod.name}.{DEFAULT[1]}" for rod in rods)
    return {name: _quantity(scene, *name.split(".", 1)) for name in names}


def _quantity(scene: Scene, member: str, output: str) -> Quantity:
    archive = scene.member(member).archive
    elements = archive.vectors.get(output, (output,))
    variable = archive.variables[elements[0]]
    return Quantity(member, elements, _LEAST_RANGE * variable.nominal, variable.unit == "rad")


def relative_error(
    trajectory: Trajectory, reference: Trajectory, quantities: Mapping[str, Quantity], ranges: Trajectory | None = None
) -> float:
    """The largest error of all quantities, share of the range of each: in `ranges`, in the reference by default."""
    a, b = trajectory.times, reference.times
    after = np.clip(np.searchsorted(b, a), 1, len(b) - 1)
    nearest = after - (a - b[after - 1] < b[after] - a)
    same = np.abs(a - b[nearest]) <= _SAME_TIME * b[-1]
    worst = 0.0
    for name, quantity in quantities.items():
        span = float(np.linalg.norm(np.ptp((ranges or reference).values[name], axis=0)))
        gap = trajectory.values[name][same] - reference.values[name][nearest[same]]
        if quantity.angle:
            gap = (gap + np.pi) % (2.0 * np.pi) - np.pi
        worst = max(worst, float(np.sqrt((gap**2).sum(axis=1).mean())) / max(span, quantity.least))
    return worst
