"""From a proposal to a choice that is good enough, and no better.

The estimate of a choice's error is how far it lies from the choice above it, all axes finer at once. What an axis adds
is measured there too: the fine choice against itself with that axis as it was, so that no coarse axis hides what
another one lacks; with inertia only where the choice has it, so that what inertia adds is counted once. The axis that
adds most climbs; those that alone spend the whole budget climb with it. In the end axes come down as far as the
estimate allows, and what each still adds is measured from below, against the choice with that axis alone made finer:
runs that cost little more than the choice does, where all axes finer can cost twenty times as much.

Oden, Prudhomme: Estimation of modeling error in computational mechanics. J. Comput. Phys. 182, 2002 (hierarchical
estimates in a quantity of interest)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ..errors import CosimError
from .ladder import Axis, Choice, Ladder
from .runs import Runs

__all__ = ["SHARE", "Found", "Tell", "above", "climb", "descend"]

SHARE = 0.7  # of the tolerance that an estimate may be: it trusts that gaps shrink from rung to rung
_LOWERED = ("inertia", "order", "strains")  # in this order: where a lower rung saves most

Tell = Callable[[Choice, float], None]  # hears of a choice that was tried, and its estimated error


@dataclass(frozen=True)
class Found:
    """Errors are shares of the range."""

    choice: Choice
    estimate: float  # of its error
    gaps: Mapping[str, float]  # axis -> what its next rung would change; inf where a run of those two fails
    refused: Mapping[str, float]  # axis -> estimated error with one rung less, where that was too much; inf as above


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
        able = {a.name: gaps[a.name] for a in ladder if choice[a.name] < a.last and gaps[a.name] > 0.0}
        if not able:
            raise CosimError(
                f"{runs.scene.name}: no level meets the tolerance {tolerance:g}: even the finest is estimated to be "
                f"off by {estimate:.2g} of the range; ask for less, or make coupling.macro_step shorter"
            )
        most = max(able, key=able.__getitem__)
        climbing = {a.name for a in ladder if a.name == most or able.get(a.name, 0.0) > tolerance}
        choice = {
            a.name: _raised(runs, a, choice, _as_still(fine, choice), allowed, stop)
            if a.name in climbing
            else choice[a.name]
            for a in ladder
        }


def descend(runs: Runs, ladder: Ladder, choice: Choice, tolerance: float, stop: float, tell: Tell) -> Found:
    """Down from a choice that is good enough until `stop` [s], as far as the estimate allows."""
    allowed, fine = SHARE * tolerance, above(ladder, choice)
    estimate, refused = runs.gap(choice, fine, stop), {}
    for axis in (name for name in _LOWERED if name in choice):
        while choice[axis] > 0:
            lower = {**choice, axis: choice[axis] - 1}
            off = runs.gap(lower, fine, stop)
            tell(lower, off)
            if off > allowed:
                refused[axis] = off
                break
            choice, estimate = lower, off
    return Found(choice, estimate, {axis.name: _left(runs, axis, choice, stop) for axis in ladder}, refused)


def _gaps(runs: Runs, ladder: Ladder, choice: Choice, stop: float) -> dict[str, float]:
    """What each axis adds to the error of the choice."""
    fine = above(ladder, choice)
    return {
        axis.name: runs.gap({**around, axis.name: choice[axis.name]}, around, stop)
        for axis in ladder
        for around in [fine if axis.name == "inertia" else _as_still(fine, choice)]
    }


def _left(runs: Runs, axis: Axis, choice: Choice, stop: float) -> float:
    try:
        return runs.gap(choice, {**choice, axis.name: axis.above(choice[axis.name])}, stop)
    except CosimError:  # of a model that was not chosen
        return math.inf


def _as_still(fine: Choice, choice: Choice) -> Choice:
    return {**fine, "inertia": choice["inertia"]} if "inertia" in choice else fine


def _raised(runs: Runs, axis: Axis, choice: Choice, fine: Choice, allowed: float, stop: float) -> int:
    """The next rung that adds little enough; of those below the fine one."""
    rung = choice[axis.name] + 1
    while rung < min(fine[axis.name], axis.last) and runs.gap({**fine, axis.name: rung}, fine, stop) > allowed:
        rung += 1
    return rung
