"""From a proposal to a choice that is good enough, and no better.

The estimate of a choice's error is how far it lies from the choice above it, all axes finer at once, so that no coarse
axis hides what another one lacks. What an axis adds is measured against the choice with that axis alone made finer:
such runs cost little more than the choice does, where all axes finer can cost twenty times as much. The axis that adds
most climbs; those that alone spend the whole budget climb with it. In the end axes come down as far as the estimate
allows.

Oden, Prudhomme: Estimation of modeling error in computational mechanics. J. Comput. Phys. 182, 2002 (hierarchical
estimates in a quantity of interest)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ...errors import CosimError
from .hierarchy import Axis, Choice, Ladder
from .runs import Runs

__all__ = ["SHARE", "Found", "Tell", "above", "climb", "descend"]

SHARE = 0.7  # of the tolerance that an estimate may be: it trusts that gaps shrink from rung to rung
_LOWERED = ("inertia", "step", "order", "strains")  # in this order: where a lower rung saves most

Tell = Callable[[Choice, float], None]  # hears of a choice that was tried, and its estimated error


@dataclass(frozen=True)
class Found:
    """Errors are shares of the range."""

    choice: Choice
    estimate: float  # of its error
    gaps: Mapping[str, float]  # axis -> what it adds to that; nan where the run that would tell fails
    refused: Mapping[str, float]  # axis -> estimated error with one rung less, where too much; inf where that fails


def above(ladder: Ladder, choice: Choice) -> Choice:
    return {axis.name: axis.above(choice[axis.name]) for axis in ladder}


def climb(runs: Runs, ladder: Ladder, choice: Choice, tolerance: float, stop: float, tell: Tell) -> Choice:
    """A choice with an estimated error of at most SHARE * tolerance until `stop` [s]. Raises CosimError where there is
    none."""
    allowed = SHARE * tolerance
    while True:
        fine = above(ladder, choice)
        estimate = runs.gap(choice, fine, stop)
        tell(choice, estimate)
        if estimate <= allowed:
            return choice
        gaps = _gaps(runs, ladder, choice, stop)
        free = [axis for axis in ladder if choice[axis.name] < axis.last]
        # All of them where no one alone shows what is wrong.
        able = {a.name: gaps[a.name] for a in free if gaps[a.name] > 0.0} or {a.name: math.inf for a in free}
        if not able:
            raise CosimError(
                f"{runs.scene.name}: no level meets the tolerance {tolerance:g}: even the finest is estimated to be "
                f"off by {estimate:.2g} of the range; ask for less, or make coupling.macro_step shorter"
            )
        most = max(able, key=able.__getitem__)
        climbing = {a.name for a in ladder if a.name == most or able.get(a.name, 0.0) > tolerance}
        choice = {
            a.name: _raised(runs, a, choice, allowed, stop) if a.name in climbing else choice[a.name] for a in ladder
        }


def descend(runs: Runs, ladder: Ladder, choice: Choice, tolerance: float, stop: float, tell: Tell) -> Found:
    """Down from a choice that is good enough until `stop` [s], as far as the estimate allows."""
    allowed, fine = SHARE * tolerance, above(ladder, choice)
    estimate, refused = runs.gap(choice, fine, stop), {}
    for axis in (name for name in _LOWERED if name in choice):
        while choice[axis] > 0 and (axis != "step" or choice.get("inertia")):  # equilibria take no time steps
            lower = {**choice, axis: choice[axis] - 1}
            off = runs.gap(lower, fine, stop)
            tell(lower, off)
            if off > allowed:
                refused[axis] = off
                break
            choice, estimate = lower, off
    return Found(choice, estimate, _gaps(runs, ladder, choice, stop), refused)


def _gaps(runs: Runs, ladder: Ladder, choice: Choice, stop: float) -> dict[str, float]:
    return {axis.name: _gap(runs, axis, choice, choice[axis.name], stop) for axis in ladder}


def _gap(runs: Runs, axis: Axis, choice: Choice, rung: int, stop: float) -> float:
    """Of that rung, to what shows what the choice lacks on the axis; nan where that fails."""
    try:
        return runs.gap({**choice, axis.name: rung}, {**choice, axis.name: axis.above(choice[axis.name])}, stop)
    except CosimError:
        return math.nan


def _raised(runs: Runs, axis: Axis, choice: Choice, allowed: float, stop: float) -> int:
    """The next rung that adds little enough; of those below the one that shows it."""
    rung = choice[axis.name] + 1
    while rung < min(axis.above(choice[axis.name]), axis.last) and _gap(runs, axis, choice, rung, stop) > allowed:
        rung += 1
    return rung
