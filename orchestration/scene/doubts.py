"""Warnings of scenes that are allowed, and probably not meant."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

from ..cosim.signals import Ramps, Steps
from ..cosim.topology import Connection
from ..errors import SceneWarning
from .manipulator import CLOSURE_EXCHANGED, DISPLACEMENT_GUESS, ROD
from .member import Member

__all__ = ["doubt_inertia", "doubt_open_loops", "doubt_times"]

_INERTIA = "tip_body.inertia"
_ROUNDING = 1e-9  # of moments of inertia


def doubt_open_loops(members: Sequence[Member], connections: Sequence[Connection]) -> None:
    """Warn of rods whose tensions follow a displacement that nothing gives: the loop of Eqs. 18 to 20 stays open."""
    fed = {c.target for c in connections}
    for member in members:
        guesses = member.archive.vectors.get(DISPLACEMENT_GUESS, ())
        known = {*member.signals, *member.parameters}
        is_rod = member.archive.description.model_name == ROD and member.value("closure") == CLOSURE_EXCHANGED
        missing = [name for name in guesses if (member.name, name) not in fed and name not in known]
        if is_rod and missing:
            text = (
                f"{member.name}: closure = exchanged, but nothing gives {', '.join(missing)}: the TCAs pull as if they "
                f"were not displaced; connect {member.name}.delta -> {member.name}.delta_guess, or set "
                f"{member.name}.closure = 'inside'"
            )
            warnings.warn(text, SceneWarning, stacklevel=2)


def doubt_inertia(members: Sequence[Member]) -> None:
    """Warn of moments of inertia that no body has: each is at most the sum of the other two."""
    for member in members:
        if member.archive.description.model_name != ROD or _INERTIA not in member.archive.vectors:
            continue
        moments = member.reals(_INERTIA)
        if max(moments) > 0.5 * sum(moments) * (1.0 + _ROUNDING):
            shown = ", ".join(f"{moment:g}" for moment in moments)
            text = f"{member.name}.{_INERTIA} = [{shown}]: no body has these; each is at most the sum of the other two"
            warnings.warn(text, SceneWarning, stacklevel=2)


def doubt_times(members: Sequence[Member], start: float, stop: float) -> None:
    """Warn of signals whose times all lie outside of the run, from start to stop [s], so that one value holds."""
    for member in members:
        for name, signal in member.signals.items():
            if not isinstance(signal, (Steps, Ramps)) or len(set(signal.values)) < 2:
                continue
            first, last = signal.times[0], signal.times[-1]
            if first >= stop or last <= start:
                text = (
                    f"{member.name}.{name}: its times, {first:g} to {last:g} s, lie outside of the run, {start:g} to "
                    f"{stop:g} s, so that it is constant; write the unit of the times, or set stop_time"
                )
                warnings.warn(text, SceneWarning, stacklevel=2)
