"""Search where other FMUs push back at a rod's tip, such as a stiff contact: its loop sets the macro step of dynamics.

A stiffness k at a tip of compliance c raises the rod's first frequency w1 to at most

    w = w1 sqrt(1 + g),   g = k c,

and g is the gain of the loop in a quasi-static run. Forces that are linear over macro steps H and meet the motion at
their ends keep this vibration up to w H = sqrt(12); beyond, it grows, however well the loop is iterated
(docs/theory/coupling.md). A run with inertia at the scene's own macro step may so be far off where a quasi-static one
is right. The search therefore refines the quasi-static models first, which cost little, and compares with inertia at
macro steps that keep the vibration, which are then halved as far as needed.
"""

from __future__ import annotations

import math
from dataclasses import replace

from ...errors import CosimError
from .dimensionless_numbers import DimensionlessNumbers
from .hierarchy import Choice, Hierarchies, highest_level, up_to, with_required
from .macro_step_search import search_macro_step
from .runs import RunCache
from .search import SHARE, Known, SearchResult, Trial, coarsen, comparison_choice, refine

__all__ = ["resolve_stiff_loop", "search_stiff_loop"]

# w H [rad] of runs with inertia, from where macro steps are halved. Less than half of the limit: the gain is that of a
# first run, and finer models may double it.
_MOST_PHASE = 1.5


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
    halvings = max(0, math.ceil(math.log2(phase / _MOST_PHASE))) if math.isfinite(phase) else 0
    return tuple(
        replace(h, requires={"macro": min(halvings, highest_level(hierarchies, "macro"))}) if h.name == "inertia" else h
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
    static = up_to(hierarchies, {**choice, "inertia": 0}, ("inertia",))
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
    # The rest is small, so it is inertia that lacks.
    moving = with_required(hierarchies, {**choice, "inertia": 1})
    gaps = {name: gap for (name, level), gap in known.items() if level == choice[name]}
    models = SearchResult(moving, estimate, {**gaps, "inertia": 0.0}, {"inertia": estimate})
    return search_macro_step(runs, hierarchies, models, choice, tolerance, stop, trial)
