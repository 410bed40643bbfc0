"""The rungs at which the climb begins: what the dimensionless numbers of a scene say, and no more where they are
unsure."""

from __future__ import annotations

import math

from .dimensionless_numbers import Numbers
from .hierarchy import Axis, Choice, Ladder

__all__ = ["propose"]

_SPREAD = 0.1  # Biot number below which a section is at one temperature
_SWINGS = 0.3  # residual vibration from which on there is no doubt about inertia
_RESERVE = 0.1  # share of the tolerance for time steps: a tighter one costs next to nothing


def propose(ladder: Ladder, numbers: Numbers, tolerance: float) -> Choice:
    found = {axis.name: 0 for axis in ladder}
    exact = {"heat": tolerance, "step": _RESERVE * tolerance}
    for axis in ladder:
        if axis.name in exact and not axis.exact and (axis.name != "heat" or numbers.biot >= _SPREAD):
            found[axis.name] = _first(axis, exact[axis.name])
    if "inertia" in found and numbers.residual >= _SWINGS:
        found["inertia"] = 1
    if "strains" in found:
        sheared = numbers.load > 0.0 and numbers.shear > tolerance
        found["strains"] = 3 if sheared else 1 if numbers.extension > tolerance else 0
    if "order" in found and not numbers.arc and numbers.load > tolerance:
        found["order"] = min(max(0, math.ceil(math.log10(numbers.load / tolerance)) - 1), 4)  # a decade per order
    return {axis.name: min(found[axis.name], axis.last) for axis in ladder}


def _first(axis: Axis, tolerance: float) -> int:
    """The lowest rung that promises that tolerance, or the highest there is."""
    promising = (k for k, rung in enumerate(axis.rungs) if float(rung.get("tolerance", 1.0)) <= 1.001 * tolerance)
    return next(promising, axis.last)
