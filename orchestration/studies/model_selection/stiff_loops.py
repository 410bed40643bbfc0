"""Search where other FMUs push back at a rod's tip, such as a stiff contact: its loop sets the macro step of dynamics.

A stiffness k at a tip of compliance c raises the rod's first frequency w1 to at most

    w = w1 sqrt(1 + g),   g = k c,

and g is the gain of the loop in a quasi-static run. Forces that are linear over macro steps H and meet the motion at
their ends keep this vibration up to w H = sqrt(12); beyond, it grows, however well the loop is iterated
(docs/theory/coupling.md). A run with inertia at the scene's own macro step may so be far off where a quasi-static one
is right. The search therefore refines the quasi-static models first, which cost little, and compares with inertia at
macro steps that resolve the vibration.
"""

from __future__ import annotations

import math
from dataclasses import replace

from ...errors import CosimError
from .dimensionless_numbers import DimensionlessNumbers
from .hierarchy import Choice, Hierarchies, with_required
from .runs import RunCache
from .search import SHARE, Known, SearchResult, Trial, coarsen, comparison_choice, explaining_gaps, refine

__all__ = ["resolve_stiff_loop", "search_stiff_loop"]

_MOST_PHASE = 1.0  # w H [rad] that counts as resolved: six steps a period, and far from the limit
# w H [rad] over the root of the tolerance: the vibration is off by a phase of (w H)^2/12 per step, and what follows the
# onset of a contact is a small share of the range.
_PHASE = 20.0


def resolve_stiff_loop(
    runs: RunCache, hierarchies: Hierarchies, numbers: DimensionlessNumbers, choice: Choice, stop: float
) -> Hierarchies:
    """The hierarchies, in which inertia requires macro steps that resolve the loop at the tip, where there is one.

    Makes a quasi-static run with the choice until `stop` [s]; without a loop, or where it fails, nothing changes.
    """
    held = runs.scene.coupling.waveform == "held"  # stable at any macro step
    if held or not numbers.loaded_by_others or not {"inertia", "macro"} <= set(choice):
        return hierarchies
    try:
        gain = runs({**choice, "inertia": 0}, stop).loop_gain
    except CosimError:
        return hierarchies
    phase = numbers.phase * math.sqrt(1.0 + gain)
    most = min(_MOST_PHASE, _PHASE * math.sqrt(runs.scene.accuracy.tolerance))
    halvings = max(0, math.ceil(math.log2(phase / most))) if math.isfinite(phase) else 0
    return tuple(
        replace(h, requires={"macro": min(halvings, _highest_macro(hierarchies))}) if h.name == "inertia" else h
        for h in hierarchies
    )


def search_stiff_loop(
    runs: RunCache,
    hierarchies: Hierarchies,
    choice: Choice,
    tolerance: float,
    window: float,
    stop: float,
    trial: Trial,
) -> SearchResult:
    """Search from the quasi-static models on; inertia is added where the whole then exceeds the tolerance.

    Parameters
    ----------
    runs, hierarchies, choice, tolerance, trial
        As those of refine(); the hierarchies are those of resolve_stiff_loop().
    window, stop : float
        First part of the scene, and its end [s].

    Raises
    ------
    CosimError
        Where no level meets the tolerance.
    """
    static = tuple(replace(h, levels=h.levels[:1], complete=True) if h.name == "inertia" else h for h in hierarchies)
    known: Known = {}
    for until in (window, stop):
        choice = refine(runs, static, choice, tolerance, until, trial, known)
    known = {key: gap for key, gap in known.items() if key[0] != "inertia"}
    for until in (window, stop):
        estimate = runs.difference(choice, comparison_choice(hierarchies, choice), until)
        trial(choice, estimate)
        if estimate > SHARE * tolerance:
            break
    else:
        return coarsen(runs, hierarchies, choice, tolerance, stop, trial, known)
    # The rest is small, so it is inertia that lacks. Runs are long now: none is made to see what else could be coarser.
    choice = with_required(hierarchies, {**choice, "inertia": 1})
    for until in (window, stop):
        choice = refine(runs, hierarchies, choice, tolerance, until, trial, known)
    error = runs.difference(choice, comparison_choice(hierarchies, choice), stop)
    gaps = explaining_gaps(runs, hierarchies, choice, tolerance, stop, known)
    return SearchResult(choice, error, gaps, {"inertia": estimate})


def _highest_macro(hierarchies: Hierarchies) -> int:
    return next(h.highest for h in hierarchies if h.name == "macro")
