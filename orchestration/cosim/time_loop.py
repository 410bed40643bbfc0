"""From the start to the stop time: events hit exactly, failed steps halved and retried, then a clear end."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator

from .master import Master, StepLog
from .step_control import Control
from .step_error import StepError, give_up

__all__ = ["drive"]

TIME_RTOL = 1e-9  # share of a step below which two times are the same
SHORTER = 0.9  # share of a step that failed from which on a try again would be much the same, without end


def drive(
    master: Master,
    control: Control,
    start: float,
    stop: float,
    breaks: Iterable[float] = (),
    progress: Callable[[float], None] = lambda time: None,
    marks: Iterable[float] = (),
) -> Iterator[StepLog]:
    """Yields the log of every accepted macro step. breaks: times [s] at which an input jumps or bends; marks: at which
    steps end without an event. The master is initialised. Raises CouplingError, SubsystemError; what was yielded
    before stays valid."""
    time, wish, cap = start, control.step, math.inf
    least = control.step * 0.5**master.settings.halvings
    events = {t for t in breaks if start < t < stop}
    near = TIME_RTOL * control.step
    marks = {t for t in marks if start < t < stop and all(abs(t - event) > near for event in events)}
    for place in sorted(events | marks | {stop}):
        if time in events:
            master.arrive(time)
        while time < place:
            remaining = place - time
            length = remaining / max(1, math.ceil(remaining / min(wish, cap) - TIME_RTOL))
            try:
                taken = control.attempt(master, time, length)
            except StepError as failure:
                cap = _shorter(time, length, failure.reached, least)
                if cap < least * (1.0 - TIME_RTOL):
                    raise give_up(time, length, failure) from failure
                continue
            wish = taken.following
            if taken.steps:
                *earlier, last = taken.steps
                if last.time != place and abs(place - last.time) <= TIME_RTOL * length:
                    last = last._replace(time=place)
                yield from (*earlier, last)
                cap *= 2.0
                time = last.time
                progress(time)


def _shorter(time: float, length: float, reached: float | None, least: float) -> float:
    """As far as a subsystem came, if that is worth a step and short enough to be another one, else half."""
    came = 0.0 if reached is None else reached - time
    return came if least <= came <= SHORTER * length else 0.5 * length
