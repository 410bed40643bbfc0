"""Explanation of a choice: one sentence per hierarchy, with the numbers that decided it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from .dimensionless_numbers import DimensionlessNumbers
from .hierarchy import FROZEN, Choice, Hierarchies
from .search import SearchResult

__all__ = ["reasons", "summary"]

_NEGLIGIBLE = 1e-9  # share of the range below which a difference counts as none
_STRAINS = {
    "bending": "bending alone",
    "extensible": "bending and stretch",
    "kirchhoff": "bending, stretch and twist",
    "cosserat": "all six strains",
}
LevelSettings = Mapping[str, Any]


def reasons(hierarchies: Hierarchies, search: SearchResult, numbers: DimensionlessNumbers) -> list[str]:
    """One sentence per hierarchy, in their order."""
    return [_SENTENCES[h.name](h.levels[search.choice[h.name]], search, numbers) for h in hierarchies]


def summary(hierarchies: Hierarchies, choice: Choice) -> str:
    """A choice in a few words."""
    return ", ".join(_WORDS[h.name](h.levels[choice[h.name]]) for h in hierarchies)


def _adds(search: SearchResult, name: str, what: str) -> str:
    if name not in search.gaps:
        return (
            f"how much {what} would change was not measured, since such runs take long: with all that is finer, it is "
            f"within {_share(search.estimate)}"
        )
    gap = search.gaps[name]
    if math.isnan(gap):
        return f"how much {what} would change is not known: a run that would tell fails"
    return f"{what} would change nothing" if gap < _NEGLIGIBLE else f"{what} would move the answer by {_share(gap)}"


def _power_of_ten(level: LevelSettings) -> str:
    return f"{level.get('tolerance', 1.0):.0e}"


def _share(gap: float) -> str:
    return f"{gap:.1e} of its range"


def _heat(level: LevelSettings, search: SearchResult, n: DimensionlessNumbers) -> str:
    if level.get(FROZEN):
        return (
            "Heat: at rest, never stepped. Nothing is heated: no voltage at any time, all at the ambient temperature "
            "from the start; it stays there exactly."
        )
    spread = f"Biot number {n.biot:.2g}: {'one temperature per section' if n.biot < 0.1 else 'no uniform section'}"
    model = {
        "lumped": "a network of few nodes",
        "reduced": f"reduced model to {_power_of_ten(level)}",
        "full": f"all nodes of the mesh, since the heat transfer varies, to {_power_of_ten(level)}",
    }[level["level"]]
    return f"Heat: {model}. {spread}; {_adds(search, 'heat', 'the next finer one')}."


def _strains(level: LevelSettings, search: SearchResult, n: DimensionlessNumbers) -> str:
    why = "Nothing shears or twists it" if n.arc else f"Shear number {n.shear:.2g}, extension number {n.extension:.2g}"
    more = "all there are" if level["strains"] == "cosserat" else _adds(search, "strains", "all six")
    return f"Strains: {_STRAINS[level['strains']]}. {why}; {more}."


def _plane(level: LevelSettings, search: SearchResult, n: DimensionlessNumbers) -> str:
    where = f"the plane at azimuth {math.degrees(level['plane']):.3g} deg"
    if level["planar"]:
        return f"Planar: TCAs, heat and loads mirror in {where}; {_adds(search, 'plane', 'leaving it')}."
    return f"Spatial: TCAs, heat and loads mirror in {where}, and yet the rod leaves it."


def _inertia(level: LevelSettings, search: SearchResult, n: DimensionlessNumbers) -> str:
    grows = "at once" if n.ramp == 0.0 else f"over {n.ramp:.2g} s"
    why = (
        f"loads grow {grows} against a first period of {1.0 / n.frequency:.2g} s, which leaves a vibration of at most "
        f"{n.residual:.2g} of the deflection"
    )
    if n.ramp == math.inf:
        why = "no load grows, so none leaves a vibration"
    if level["dynamic"]:
        off = search.rejected["inertia"]
        without = "the run fails" if off == math.inf else f"the answer would be off by {_share(off)}"
        return f"Dynamic: {why}; without inertia {without}."
    return f"Quasi-static: {why}; {_adds(search, 'inertia', 'inertia')}."


def _order(level: LevelSettings, search: SearchResult, n: DimensionlessNumbers) -> str:
    degree = level["order"]
    shape = f"Strains of degree {degree} along the rod" if degree else "Constant strain (order 0)"
    why = f"gravity number {n.gravity:.2g}, tip load number {n.tip:.2g}"
    why += ("" if n.parallel else ", TCAs not parallel") + (", other FMUs push it" if n.loaded_by_others else "")
    if n.arc:
        why = "no gravity, no load at the tip and parallel TCAs: equilibria are arcs exactly"
    return f"{shape}: {why}; {_adds(search, 'order', 'two orders more')}."


def _step(level: LevelSettings, search: SearchResult, n: DimensionlessNumbers) -> str:
    return f"Rod solver: relative tolerance {level['tolerance']:.0e}; {_adds(search, 'step', 'a tenth of it')}."


def _macro(level: LevelSettings, search: SearchResult, n: DimensionlessNumbers) -> str:
    share = level["macro_step"]
    step = "the scene's own" if share == 1.0 else f"the scene's own over {1.0 / share:.0f}"
    return f"Macro step: {step}, the TCAs' loop closed inside the rod; {_adds(search, 'macro', 'half of it')}."


_SENTENCES = {
    "heat": _heat,
    "strains": _strains,
    "plane": _plane,
    "inertia": _inertia,
    "order": _order,
    "step": _step,
    "macro": _macro,
}
_WORDS: Mapping[str, Callable[[LevelSettings], str]] = {
    "heat": lambda level: (
        "heat at rest"
        if level.get(FROZEN)
        else "lumped heat"
        if level["level"] == "lumped"
        else f"heat to {_power_of_ten(level)}"
    ),
    "strains": lambda level: _STRAINS[level["strains"]],
    "plane": lambda level: "planar" if level["planar"] else "spatial",
    "inertia": lambda level: "dynamic" if level["dynamic"] else "quasi-static",
    "order": lambda level: f"order {level['order']}",
    "step": lambda level: f"rod to {_power_of_ten(level)}",
    "macro": lambda level: f"macro step / {1.0 / level['macro_step']:.0f}",
}
