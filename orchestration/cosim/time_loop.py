"""From the start to the stop time: events are hit exactly, failed steps are halved and retried."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator

from .master import Master, StepLog
from .step_control import Control
from .step_error import StepError, give_up

__all__ = ["drive"]

TIME_RTOL = 1e-9  # share of a step below which two times are the same
RETRY_RATIO = 0.9  # largest ratio of a retried step to the failed one; closer to 1 it would fail again, without end


def drive(
    master: Master,
    control: Control,
    start: float,
    stop: float,
    breaks: Iterable[float] = (),
    progress: Callable[[float], None] = lambda time: None,
    marks: Iterable[float] = (),
) -> Iterator[StepLog]:
    """Yield the log of every accepted macro step; what was yielded stays valid after an error.

    Parameters
    ----------
    master : Master
        Initialised.
    control : Control
        Chooses lengths of steps.
    start, stop : float
        Times [s].
    breaks : iterable of float
        Times [s] at which an input or its slope jumps.
    progress : callable
        Receives the time [s] after every step.
    marks : iterable of float
        Times [s] at which steps end, without an event.

    Raises
    ------
    CouplingError, SubsystemError
        Where halving a step does not help.
    """
    time, wish, cap = start, control.step, math.inf
    least = control.step * 0.5**master.settings.halvings
    events = {t for t in breaks if start < t < stop}
    near = TIME_RTOL * control.step
    marks = {t for t in marks if start < t < stop and all(abs(t - event) > near for event in events)}
    for target in sorted(events | marks | {stop}):
        if time in events:
            master.arrive(time)
        while time < target:
            remaining = target - time
            length = remaining / max(1, math.ceil(remaining / min(wish, cap) - TIME_RTOL))
            try:
                result = control.attempt(master, time, length)
            except StepError as failure:
                cap = _shorter(time, length, failure.reached, least)
                if cap < least * (1.0 - TIME_RTOL):
                    raise give_up(time, length, failure) from failure
                continue
            wish = result.next_length
            if result.steps:
                *earlier, last = result.steps
                if last.time != target and abs(target - last.time) <= TIME_RTOL * length:
                    last = last._replace(time=target)
                yield from (*earlier, last)
                cap *= 2.0
                time = last.time
                progress(time)


def _shorter(time: float, length: float, reached: float | None, least: float) -> float:
    """Return the length [s] to retry with: as far as a subsystem came if that is a useful step, else half."""
    came = 0.0 if reached is None else reached - time
    return came if least <= came <= RETRY_RATIO * length else 0.5 * length
