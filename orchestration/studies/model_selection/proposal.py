"""Levels at which the search begins: those that the dimensionless numbers of a scene justify, the coarser in doubt."""

from __future__ import annotations

import math

from .dimensionless_numbers import DimensionlessNumbers
from .hierarchy import Choice, Hierarchies, ModelHierarchy

__all__ = ["FOLLOWING", "macro_steps_follow", "propose_choice"]

_UNIFORM = 0.1  # Biot number below which a section has one temperature (textbook bound of the lumped model)
_SWINGS = 0.3  # residual vibration, share of the deflection, from which on inertia is needed beyond doubt
_RINGS = 20.0  # residual vibration / tolerance, rms over the scene, from which on inertia is needed beyond doubt
_RESERVE = 0.1  # tolerance of time steps / tolerance asked for: a tighter one costs next to nothing
_SECOND_MODE = 6.27  # frequency of a clamped-free beam's second mode over that of its first
_SHORT_STEP = 100.0  # (phase of the second mode)^4 / tolerance of steps that no tolerance shortens any further
FOLLOWING = 1  # level of the rod's tolerance where macro steps follow its motion
_MOST_ORDER = 4  # highest order proposed; the search goes on from there


def propose_choice(hierarchies: Hierarchies, numbers: DimensionlessNumbers, tolerance: float) -> Choice:
    """The first choice of a search for that tolerance (share of the range)."""
    choice = {h.name: 0 for h in hierarchies}
    needed = {"heat": tolerance, "step": _RESERVE * tolerance}
    for hierarchy in hierarchies:
        name = hierarchy.name
        if name in needed and not hierarchy.exact and (name != "heat" or numbers.biot >= _UNIFORM):
            choice[name] = _first_level(hierarchy, needed[name])
    rings = numbers.vibration >= _RINGS * tolerance
    if "inertia" in choice and (numbers.residual >= _SWINGS or rings):
        choice["inertia"] = 1
    # Equilibria take no time steps; where inertia turns out to be needed without a vibration, long ones mostly do.
    if "step" in choice and (macro_steps_follow(numbers.phase, tolerance) or not choice.get("inertia")):
        choice["step"] = FOLLOWING
    if "strains" in choice:
        sheared = (numbers.load > 0.0 or rings) and numbers.shear > tolerance
        choice["strains"] = 3 if sheared else 1 if numbers.extension > tolerance else 0
    if "order" in choice and not numbers.arc and numbers.load > tolerance:
        decades = math.ceil(math.log10(numbers.load / tolerance))  # each order gains about one
        choice["order"] = min(max(0, decades - 1), _MOST_ORDER)
    elif "order" in choice and rings:  # the inertia of a vibration bends the rod as a load does
        decades = math.ceil(math.log10(numbers.vibration / tolerance))
        choice["order"] = min(max(0, decades - 1), _MOST_ORDER)
    return {h.name: min(choice[h.name], h.highest) for h in hierarchies}


def macro_steps_follow(phase: float, tolerance: float) -> bool:
    """Whether macro steps of that phase of the first mode [rad] follow the second mode to a tolerance.

    They bound the steps of the integrator, so that a tighter tolerance of these only costs. The macro step's own
    hierarchy halves them, and shows whether they do.
    """
    return (_SECOND_MODE * phase) ** 4 <= _SHORT_STEP * tolerance


def _first_level(hierarchy: ModelHierarchy, tolerance: float) -> int:
    """The coarsest level that promises that tolerance, or the finest."""
    levels = enumerate(hierarchy.levels)
    promising = (k for k, level in levels if float(level.get("tolerance", 1.0)) <= 1.001 * tolerance)
    return next(promising, hierarchy.highest)
