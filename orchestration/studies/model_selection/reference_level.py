"""The reference that errors are measured against: the finest levels, over the whole scene."""

from __future__ import annotations

from collections.abc import Sequence

from .hierarchy import Choice, Hierarchies, with_required
from .runs import RunCache

__all__ = ["reference_choice"]

_HALVINGS = 2  # of the shortest macro step chosen
_FOLLOWED = 5  # level of the rod's tolerance from which on waves are followed, not damped by the time steps
_COARSER_HEAT = 2  # levels of heat: loaded in a thirtieth of the time
_NEGLIGIBLE = 0.02  # share of the tolerance below which a difference is neglected


def reference_choice(runs: RunCache, hierarchies: Hierarchies, choices: Sequence[Choice], tolerance: float) -> Choice:
    """The finest level of every hierarchy, the rod's time steps only as fine as they make a difference.

    Undamped waves cost minutes at the finest time steps, so the finer of the first two levels that agree is taken; they
    are compared with a coarser heat, which loads faster. tolerance: the smallest one that an error is compared with.
    """
    finest = {h.name: len(h.levels) - 1 for h in hierarchies}
    coarsest = {**finest, "macro": min(max(choice["macro"] for choice in choices), finest["macro"])}
    resolved = with_required(hierarchies, coarsest)["macro"]
    best = {**finest, "macro": min(resolved + _HALVINGS, finest["macro"])}
    if "step" in best:
        first = max(_FOLLOWED, *(choice["step"] + 1 for choice in choices))
        heat = {"heat": max(finest["heat"] - _COARSER_HEAT, 0)} if "heat" in finest else {}
        for level in range(first, finest["step"]):
            coarse, fine = ({**best, **heat, "step": step} for step in (level, level + 1))
            if runs.difference(coarse, fine, runs.scene.stop_time) <= _NEGLIGIBLE * tolerance:
                return {**best, "step": level + 1}
    return best
