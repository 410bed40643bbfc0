"""Why a choice is what it is, in sentences with the numbers that decided it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from .dimensionless_numbers import Numbers
from .hierarchy import REST, Choice, Ladder
from .search import Found

__all__ = ["brief", "reasons"]

_NOTHING = 1e-9  # share of the range
_STRAINS = {
    "bending": "bending alone",
    "extensible": "bending and stretch",
    "kirchhoff": "bending, stretch and twist",
    "cosserat": "all six strains",
}
Rung = Mapping[str, Any]


def reasons(ladder: Ladder, found: Found, numbers: Numbers) -> list[str]:
    """One sentence per axis, in the order of the ladder."""
    return [_SENTENCES[a.name](a.rungs[found.choice[a.name]], found, numbers) for a in ladder]


def brief(ladder: Ladder, choice: Choice) -> str:
    """What a choice is, in a few words."""
    return ", ".join(_BRIEF[a.name](a.rungs[choice[a.name]]) for a in ladder)


def _adds(found: Found, axis: str, what: str) -> str:
    gap = found.gaps[axis]
    if math.isnan(gap):
        return f"how much {what} would change is not known: a run that would tell fails"
    return f"{what} would change nothing" if gap < _NOTHING else f"{what} would move the answer by {_share(gap)}"


def _power(rung: Rung) -> str:
    return f"{rung['tolerance']:.0e}"


def _share(gap: float) -> str:
    return f"{gap:.1e} of its range"


def _heat(rung: Rung, found: Found, n: Numbers) -> str:
    if rung.get(REST):
        return (
            "Heat: at rest, never stepped. Nothing is heated: no voltage at any time, all at the ambient temperature "
            "from the start; it stays there exactly."
        )
    spread = f"Biot number {n.biot:.2g}: {'one temperature per section' if n.biot < 0.1 else 'no uniform section'}"
    model = "a network of few nodes" if rung["level"] == "lumped" else f"reduced model to {rung['tolerance']:.0e}"
    return f"Heat: {model}. {spread}; {_adds(found, 'heat', 'the next finer one')}."


def _strains(rung: Rung, found: Found, n: Numbers) -> str:
    why = "Nothing shears or twists it" if n.arc else f"Shear number {n.shear:.2g}, extension number {n.extension:.2g}"
    more = "all there are" if rung["strains"] == "cosserat" else _adds(found, "strains", "all six")
    return f"Strains: {_STRAINS[rung['strains']]}. {why}; {more}."


def _plane(rung: Rung, found: Found, n: Numbers) -> str:
    where = f"the plane at azimuth {math.degrees(rung['plane']):.3g} deg"
    if rung["planar"]:
        return f"Planar: TCAs, heat and loads mirror in {where}; {_adds(found, 'plane', 'leaving it')}."
    return f"Spatial: TCAs, heat and loads mirror in {where}, and yet the rod leaves it."


def _inertia(rung: Rung, found: Found, n: Numbers) -> str:
    grows = "at once" if n.ramp == 0.0 else f"over {n.ramp:.2g} s"
    why = (
        f"loads grow {grows} against a first period of {1.0 / n.frequency:.2g} s, which leaves a vibration of at most "
        f"{n.residual:.2g} of the deflection"
    )
    if n.ramp == math.inf:
        why = "no load grows, so none leaves a vibration"
    if rung["dynamic"]:
        off = found.refused["inertia"]
        without = "the run fails" if off == math.inf else f"the answer would be off by {_share(off)}"
        return f"Dynamic: {why}; without inertia {without}."
    return f"Quasi-static: {why}; {_adds(found, 'inertia', 'inertia')}."


def _order(rung: Rung, found: Found, n: Numbers) -> str:
    degree = rung["order"]
    shape = f"Strains of degree {degree} along the rod" if degree else "Constant strain (order 0)"
    why = f"gravity number {n.gravity:.2g}, tip load number {n.tip:.2g}" + ("" if n.parallel else ", TCAs not parallel")
    if n.arc:
        why = "no gravity, no load at the tip and parallel TCAs: equilibria are arcs exactly"
    return f"{shape}: {why}; {_adds(found, 'order', 'two orders more')}."


def _step(rung: Rung, found: Found, n: Numbers) -> str:
    return f"Rod solver: relative tolerance {rung['tolerance']:.0e}; {_adds(found, 'step', 'a tenth of it')}."


def _macro(rung: Rung, found: Found, n: Numbers) -> str:
    share = rung["macro_step"]
    step = "the scene's own" if share == 1.0 else f"the scene's own over {1.0 / share:.0f}"
    return f"Macro step: {step}, the TCAs' loop closed inside the rod; {_adds(found, 'macro', 'half of it')}."


_SENTENCES = {
    "heat": _heat,
    "strains": _strains,
    "plane": _plane,
    "inertia": _inertia,
    "order": _order,
    "step": _step,
    "macro": _macro,
}
_BRIEF: Mapping[str, Callable[[Rung], str]] = {
    "heat": lambda rung: (
        "heat at rest" if rung.get(REST) else "lumped heat" if rung["level"] == "lumped" else f"heat to {_power(rung)}"
    ),
    "strains": lambda rung: _STRAINS[rung["strains"]],
    "plane": lambda rung: "planar" if rung["planar"] else "spatial",
    "inertia": lambda rung: "dynamic" if rung["dynamic"] else "quasi-static",
    "order": lambda rung: f"order {rung['order']}",
    "step": lambda rung: f"rod to {_power(rung)}",
    "macro": lambda rung: f"macro step / {1.0 / rung['macro_step']:.0f}",
}
