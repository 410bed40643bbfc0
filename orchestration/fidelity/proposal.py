"""The rungs at which the climb begins: what the dimensionless numbers of a scene say, and no more where they are
unsure."""

from __future__ import annotations

import math

from .ladder import Choice, Ladder
from .screens import Numbers

__all__ = ["propose"]

_SPREAD = 0.1  # Biot number below which a section is at one temperature
_SWINGS = 0.3  # residual vibration from which on there is no doubt about inertia
_RESERVE = 0.1  # share of the tolerance for what costs next to nothing: heat and time steps


def propose(ladder: Ladder, numbers: Numbers, tolerance: float) -> Choice:
    found = {axis.name: 0 for axis in ladder}
    decades = math.ceil(-math.log10(_RESERVE * tolerance) - 1e-9)  # the rung of a tolerance 10^-k is k, or k - 1
    if "heat" in found and numbers.biot >= _SPREAD:
        found["heat"] = decades
    if "step" in found:
        found["step"] = decades - 1
    if "inertia" in found and numbers.residual >= _SWINGS:
        found["inertia"] = 1
    if "strains" in found:
        sheared = numbers.load > 0.0 and numbers.shear > tolerance
        found["strains"] = 3 if sheared else 1 if numbers.extension > tolerance else 0
    if "order" in found and not numbers.arc and numbers.load > tolerance:
        found["order"] = min(max(0, math.ceil(math.log10(numbers.load / tolerance)) - 1), 4)  # a decade per order
    return {axis.name: min(found[axis.name], len(axis.rungs) - 1) for axis in ladder}
