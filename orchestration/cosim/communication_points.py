"""Communication points: the times at which macro steps end.

Steps of one length h end at origin + k h, computed from the integer k, so that rounding does not add up, and are handed
to the subsystems as h itself. The origin is the start, or the last event that lies between two such points. A shorter
step is taken only to an event or to the stop time.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

__all__ = ["Segment", "segments"]

TIME_RTOL = 1e-9  # share of a step below which two times are the same
TIME_EPS = 4.0 * 2.0**-52  # share of a time below which two times are the same: what rounding of k h may amount to


class Segment(NamedTuple):
    """The way from one communication point to the next.

    Attributes
    ----------
    length : float
        Length to hand over if one step covers it [s].
    end : float
        Its end [s].
    event : bool
        Whether inputs jump there.
    """

    length: float
    end: float
    event: bool


def segments(
    start: float, stop: float, step: float | None, events: Iterable[float], marks: Iterable[float] = ()
) -> Iterator[Segment]:
    """Yield the segments from `start` to `stop` [s].

    Parameters
    ----------
    start, stop : float
        Times [s].
    step : float or None
        Distance of equidistant communication points [s]; None: the only points are events, marks and the stop time.
    events, marks : iterable of float
        Times [s] at which inputs jump, and at which a step is to end. One that is a communication point but for
        rounding takes its time.
    """
    origin, number, time = start, 0, start
    for target, event in _targets(start, stop, step, events, marks):
        if step is None:
            yield Segment(_within(time, target - time, stop), target, event)
            time = target
            continue
        count = round((target - origin) / step)
        on_grid = abs(origin + count * step - target) <= _tolerance(target, step)
        if not on_grid and origin + count * step > target:
            count -= 1
        while number < count:
            number += 1
            last = on_grid and number == count
            end = stop if last and target == stop else origin + number * step
            yield Segment(_within(time, step, stop), end, event and last)
            time = end
        if not on_grid:
            yield Segment(_within(time, target - time, stop), target, event)
            origin, number, time = target, 0, target


def _targets(
    start: float, stop: float, step: float | None, events: Iterable[float], marks: Iterable[float]
) -> list[tuple[float, bool]]:
    """Return times in order and whether each is an event; of several that are the same but for rounding, the first."""
    targets: list[tuple[float, bool]] = []
    for time, event in sorted([*((t, True) for t in events), *((t, False) for t in marks)]):
        near = _tolerance(time, step)
        if not start + near < time < stop - near:
            continue
        if targets and time - targets[-1][0] <= near:
            targets[-1] = (targets[-1][0], targets[-1][1] or event)
        else:
            targets.append((time, event))
    return [*targets, (stop, False)]


def _tolerance(time: float, step: float | None) -> float:
    """Return the distance [s] within which two times are the same."""
    return max(TIME_RTOL * (step or 0.0), TIME_EPS * abs(time))


def _within(time: float, length: float, stop: float) -> float:
    """Return the length, reduced by rounding where time + length exceeds the stop time, which FMUs may refuse."""
    if time + length <= stop:
        return length
    length = stop - time
    while time + length > stop:
        length = math.nextafter(length, 0.0)
    return length
