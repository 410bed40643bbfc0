"""Search for the cheapest choice whose estimated error meets a tolerance.

The estimated error of a choice is its difference to the comparison choice, which is finer in all hierarchies at once,
so that no coarse hierarchy hides what another one lacks. The contribution of one hierarchy is measured against the
choice with that hierarchy alone made finer: such runs cost little more than the choice does, where a choice finer in
all can cost twenty times as much. The hierarchy that contributes most is refined, and with it those that alone exceed
the whole budget. In the end levels are coarsened as far as the estimate allows.

Oden, Prudhomme: Estimation of modeling error in computational mechanics. J. Comput. Phys. 182, 2002 (hierarchical
estimates in a quantity of interest).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ...errors import CosimError
from .hierarchy import Choice, Hierarchies, ModelHierarchy, with_required
from .runs import RunCache

__all__ = ["SHARE", "Known", "SearchResult", "Trial", "coarsen", "comparison_choice", "refine"]

SHARE = 0.7  # largest estimate / tolerance; the reserve covers that differences shrink from level to level, not to zero
_NEGLIGIBLE = 0.2  # contribution / largest estimate below which it is not measured again at finer levels of the others
# CPU time of runs made for the explanation alone [s]: what the choice lacks is estimated already, by one run with
# everything finer. Most scenes need a tenth of it for all of them.
_EXPLAINING = 0.5
_COARSENED = ("inertia", "step", "order", "strains")  # in this order: where a coarser level saves most

Trial = Callable[[Choice, float], None]  # called with every choice tried and its estimated error
Known = dict[tuple[str, int], float]  # contributions measured so far, by hierarchy and level


@dataclass(frozen=True)
class SearchResult:
    """Outcome of a search. Errors are shares of the range of the quantities asked for.

    Parameters
    ----------
    choice : Choice
        The levels chosen.
    estimate : float
        Estimated error of the choice.
    gaps : mapping of str to float
        Contribution of each hierarchy to it; nan where the run that would show it fails; missing where such runs take
        too long. Negligible ones are those of an earlier choice with the same level.
    rejected : mapping of str to float
        Estimated error with one level less, where that is too much, until then; inf where that run fails.
    """

    choice: Choice
    estimate: float
    gaps: Mapping[str, float]
    rejected: Mapping[str, float]


def comparison_choice(hierarchies: Hierarchies, choice: Choice) -> Choice:
    """The choice, finer in all hierarchies, whose difference to `choice` estimates the error of `choice`."""
    return with_required(hierarchies, {h.name: h.comparison_level(choice[h.name]) for h in hierarchies})


def refine(
    runs: RunCache,
    hierarchies: Hierarchies,
    choice: Choice,
    tolerance: float,
    stop: float,
    trial: Trial,
    known: Known | None = None,
    share: float = SHARE,
) -> Choice:
    """Refine a choice until its estimated error until `stop` [s] is at most share * tolerance.

    known: contributions measured before; it gets those measured here. Raises CosimError where no choice meets that.
    """
    allowed, known = share * tolerance, {} if known is None else known
    while True:
        estimate = runs.difference(choice, comparison_choice(hierarchies, choice), stop)
        trial(choice, estimate)
        if estimate <= allowed:
            return choice
        gaps = _gaps(runs, hierarchies, choice, stop, known, _NEGLIGIBLE * allowed)
        if sum(gap for gap in gaps.values() if gap > 0.0) < 0.5 * estimate:  # what was negligible may be no longer
            gaps = _gaps(runs, hierarchies, choice, stop, known, -math.inf)
        refinable = [h for h in hierarchies if choice[h.name] < h.highest]
        # All of them where no single one shows what is wrong.
        candidates = {h.name: gaps[h.name] for h in refinable if gaps[h.name] > 0.0} or {
            h.name: math.inf for h in refinable
        }
        if not candidates:
            raise CosimError(
                f"{runs.scene.name}: no level meets the tolerance {tolerance:g}: even the finest is estimated to be "
                f"off by {estimate:.2g} of the range; ask for less, make coupling.macro_step shorter, or, where a body "
                "buckles to a side that rounding chooses, let a small load choose it, such as tip_force[2] of a rod"
            )
        largest = max(candidates, key=candidates.__getitem__)
        refined = {h.name for h in hierarchies if h.name == largest or candidates.get(h.name, 0.0) > tolerance}
        choice = {
            h.name: _refined_level(runs, hierarchies, h, choice, allowed, stop) if h.name in refined else choice[h.name]
            for h in hierarchies
        }
        choice = with_required(hierarchies, choice)


def coarsen(
    runs: RunCache,
    hierarchies: Hierarchies,
    choice: Choice,
    tolerance: float,
    stop: float,
    trial: Trial,
    known: Known | None = None,
    share: float = SHARE,
) -> SearchResult:
    """Coarsen a choice that meets the tolerance until `stop` [s] as far as an error of share * tolerance allows.

    Runs that are too coarse end where they have shown it. known: contributions measured before.
    """
    allowed, fine = share * tolerance, comparison_choice(hierarchies, choice)
    known = {} if known is None else known
    estimate, rejected = runs.difference(choice, fine, stop), {}
    for name in (name for name in _COARSENED if name in choice):
        while choice[name] > 0 and (name != "step" or choice.get("inertia")):  # equilibria take no time steps
            coarser = {**choice, name: choice[name] - 1}
            error = runs.difference(coarser, fine, stop, allowed)
            trial(coarser, error)
            if error > allowed:
                rejected[name] = error
                break
            choice, estimate = coarser, error
    gaps = _explaining_gaps(runs, hierarchies, choice, tolerance, stop, known)
    return SearchResult(choice, estimate, gaps, rejected)


def _explaining_gaps(
    runs: RunCache, hierarchies: Hierarchies, choice: Choice, tolerance: float, stop: float, known: Known
) -> dict[str, float]:
    """Contributions that explain a choice that is good enough; those that only long runs would show are left out."""
    negligible, left, gaps = _NEGLIGIBLE * SHARE * tolerance, _EXPLAINING, {}
    for h in hierarchies:
        key, finer = (h.name, choice[h.name]), _finer(hierarchies, h, choice)
        if not known.get(key, math.inf) <= negligible:
            made, halvings = runs.cost(finer), finer.get("macro", 0) - choice.get("macro", 0)
            if not made and runs.cost(choice) * 2.0**halvings > left:
                continue
            known[key] = _gap(runs, hierarchies, h, choice, choice[h.name], stop)
            left -= runs.cost(finer) - made
        gaps[h.name] = known[key]
    return gaps


def _gaps(
    runs: RunCache, hierarchies: Hierarchies, choice: Choice, stop: float, known: Known, negligible: float
) -> dict[str, float]:
    """Contributions of all hierarchies: those known to be negligible at the level chosen, all others measured."""
    gaps = {}
    for h in hierarchies:
        key = (h.name, choice[h.name])
        if not known.get(key, math.inf) <= negligible:
            known[key] = _gap(runs, hierarchies, h, choice, choice[h.name], stop)
        gaps[h.name] = known[key]
    return gaps


def _finer(hierarchies: Hierarchies, hierarchy: ModelHierarchy, choice: Choice) -> Choice:
    """The choice with the comparison level in one hierarchy."""
    level = hierarchy.comparison_level(choice[hierarchy.name])
    return with_required(hierarchies, {**choice, hierarchy.name: level})


def _gap(
    runs: RunCache, hierarchies: Hierarchies, hierarchy: ModelHierarchy, choice: Choice, level: int, stop: float
) -> float:
    """Difference between `level` and the comparison level of the choice in one hierarchy; nan where a run fails."""
    try:
        return runs.difference({**choice, hierarchy.name: level}, _finer(hierarchies, hierarchy, choice), stop)
    except CosimError:
        return math.nan


def _refined_level(
    runs: RunCache, hierarchies: Hierarchies, hierarchy: ModelHierarchy, choice: Choice, allowed: float, stop: float
) -> int:
    """The next finer level whose remaining gap is allowed, at most the comparison level."""
    level = choice[hierarchy.name] + 1
    most = min(hierarchy.comparison_level(choice[hierarchy.name]), hierarchy.highest)
    while level < most and _gap(runs, hierarchies, hierarchy, choice, level, stop) > allowed:
        level += 1
    return level
