"""What errors are measured against: the most model there is, over the whole scene."""

from __future__ import annotations

from collections.abc import Sequence

from .hierarchy import Choice, Ladder
from .runs import Runs

__all__ = ["truth"]

_HALVINGS = 2  # of the shortest macro step chosen
_SURE = 5  # rung of the rod's tolerance from which on waves are followed rather than damped away by the steps
_LESS = 2  # rungs of heat: loaded in a thirtieth of the time
_SAME = 0.02  # share of the tolerance that is no difference


def truth(runs: Runs, ladder: Ladder, choices: Sequence[Choice], tolerance: float) -> Choice:
    """The last rung of every axis. But the rod's time steps are only as fine as makes no difference, the finer of two
    rungs that agree, since waves that nothing damps cost minutes at the last one; they are compared with a heat
    that takes less to load. tolerance: the smallest that an error is held against."""
    last = {axis.name: len(axis.rungs) - 1 for axis in ladder}
    best = {**last, "macro": min(max(choice["macro"] for choice in choices) + _HALVINGS, last["macro"])}
    if "step" in best:
        first = max(_SURE, *(choice["step"] + 1 for choice in choices))
        less = {"heat": max(last["heat"] - _LESS, 0)} if "heat" in last else {}
        for rung in range(first, last["step"]):
            coarse, fine = ({**best, **less, "step": step} for step in (rung, rung + 1))
            if runs.gap(coarse, fine, runs.scene.stop_time) <= _SAME * tolerance:
                return {**best, "step": rung + 1}
    return best
