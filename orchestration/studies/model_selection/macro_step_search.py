"""Search where other FMUs push back at a rod's tip: all models at the scene's own macro step first, then that step.

Macro steps of a contact resolve its onset, and a run with short ones takes a hundred times the time of one with the
scene's own. What the body's model and its heat contribute to the error is the same with all of them, so it is found
where runs are short. The tolerance of the rod's time steps stays as it was proposed: macro steps bound these.

Then the macro step is halved until what its halving changes is small enough. With a waveform of order p the error of
the longer of two is 2^p/(2^p - 1) of their difference, that of the shorter 1/(2^p - 1) (Richardson); the onset of a
contact, which comes early, shows most of it. All else that is finer is compared once more with the longer of both.
"""

from __future__ import annotations

import math

from ...errors import CosimError
from .hierarchy import Choice, Hierarchies, highest_level, up_to
from .runs import RunCache
from .search import SHARE, Known, SearchResult, Trial, coarsen, comparison_choice, refine

__all__ = ["search_macro_step", "search_macro_step_last"]

_OTHERS = 0.75  # share of the allowed error that all but the macro step may take
_PARTED = 0.5  # difference over the scene from which on runs whose first part agrees have gone different ways


def search_macro_step_last(
    runs: RunCache,
    hierarchies: Hierarchies,
    choice: Choice,
    tolerance: float,
    window: float,
    stop: float,
    trial: Trial,
) -> SearchResult:
    """Search for the models with the macro step of the choice, then for the macro step.

    Parameters
    ----------
    runs, hierarchies, choice, tolerance, trial
        As those of refine().
    window, stop : float
        First part of the scene, and its end [s].

    Raises
    ------
    CosimError
        Where no level meets the tolerance.
    """
    models = up_to(hierarchies, choice, ("macro", "step"))
    known: Known = {}
    choice = refine(runs, models, choice, tolerance, window, trial, known, _OTHERS * SHARE)

    def tried(choice: Choice, estimate: float) -> None:
        trial(choice, estimate)
        _require_one_way(runs, estimate, window, stop)

    choice = refine(runs, models, choice, tolerance, stop, tried, known, _OTHERS * SHARE)
    coarsest = coarsen(runs, models, choice, tolerance, stop, trial, known, _OTHERS * SHARE)
    return search_macro_step(runs, hierarchies, coarsest, coarsest.choice, tolerance, stop, trial)


def search_macro_step(
    runs: RunCache,
    hierarchies: Hierarchies,
    models: SearchResult,
    like: Choice,
    tolerance: float,
    stop: float,
    trial: Trial,
) -> SearchResult:
    """Search for the macro step of models that are chosen, from that of their choice on.

    Parameters
    ----------
    runs, hierarchies, tolerance, stop, trial
        As those of refine().
    models : SearchResult
        That of the models; the choice need not have been run.
    like : Choice
        A choice that has been run to the end of the scene, whose ranges are those of the answer.

    Raises
    ------
    CosimError
        Where no level meets the tolerance.
    """
    gaps = {name: gap for name, gap in models.gaps.items() if name not in ("macro", "step")}
    allowed, ratio = SHARE * tolerance, 2.0**runs.scene.coupling.torn.order
    highest = highest_level(hierarchies, "macro")
    for level in range(models.choice["macro"], highest + 1):
        choice, half = {**models.choice, "macro": level}, {**models.choice, "macro": level + 1}
        if runs.first_parts_differ(choice, half, stop, allowed * (ratio - 1.0), like):
            continue
        gap = runs.difference(choice, half, stop)
        if gap > allowed * (ratio - 1.0):
            continue
        finer = comparison_choice(up_to(hierarchies, choice, ("macro",)), choice)
        rest = runs.difference(choice, finer, stop)
        for each, error in ((choice, gap * ratio / (ratio - 1.0)), (half, gap / (ratio - 1.0))):
            trial(each, rest + error)
            if rest + error <= allowed:
                gaps |= {"macro": gap} if each is choice else {}
                return SearchResult(each, rest + error, gaps, models.rejected)
        if rest > _OTHERS * allowed:  # what was compared at a longer macro step does not hold at this one
            break
    refined = refine(runs, hierarchies, choice, tolerance, stop, trial)
    return coarsen(runs, hierarchies, refined, tolerance, stop, trial)


def _require_one_way(runs: RunCache, difference: float, window: float, stop: float) -> None:
    """Raise CosimError where runs that agree until the end of the window [s] part until the end of the scene [s]."""
    if _PARTED < difference < math.inf:
        raise CosimError(
            f"{runs.scene.name}: runs that agree until t = {window:.4g} s are apart by {difference:.0%} of the range "
            f"until t = {stop:.4g} s, so that no model is right: something goes one of several ways, which rounding "
            "chooses, as a finger that buckles to one side; let a small load choose it, such as tip_force[2] of a rod "
            "across the push (1e-5 N), or end the scene before"
        )
