"""Levels at which the search begins: those that the dimensionless numbers of a scene justify, the coarser in doubt."""

from __future__ import annotations

import math

from .dimensionless_numbers import DimensionlessNumbers
from .hierarchy import Choice, Hierarchies, ModelHierarchy

__all__ = ["propose_choice"]

_UNIFORM = 0.1  # Biot number below which a section has one temperature (textbook bound of the lumped model)
_SWINGS = 0.3  # residual vibration, share of the deflection, from which on inertia is needed beyond doubt
_RINGS = 20.0  # residual vibration / tolerance, rms over the scene, from which on inertia is needed beyond doubt
_RESERVE = 0.1  # tolerance of time steps / tolerance asked for: a tighter one costs next to nothing
_SECOND_MODE = 6.27  # frequency of a clamped-free beam's second mode over that of its first
_SHORT_STEP = 100.0  # (phase of the second mode)^4 / tolerance of steps that no tolerance shortens any further
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
    # Macro steps bound the steps of the integrator: where they follow the second mode, a tighter tolerance only costs.
    # The macro step's own hierarchy halves them, and shows whether they do. Forces of other FMUs kink at the ends
    # of macro steps: at a tight tolerance a rod with inertia follows each of them.
    follow = (_SECOND_MODE * numbers.phase) ** 4 <= _SHORT_STEP * tolerance
    if "step" in choice and (follow or numbers.loaded_by_others):
        choice["step"] = 1
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


def _first_level(hierarchy: ModelHierarchy, tolerance: float) -> int:
    """The coarsest level that promises that tolerance, or the finest."""
    levels = enumerate(hierarchy.levels)
    promising = (k for k, level in levels if float(level.get("tolerance", 1.0)) <= 1.001 * tolerance)
    return next(promising, hierarchy.highest)
