"""Communication points: the times at which macro steps end.

Steps of one length h end at origin + k h, computed from the integer k, so that rounding does not add up, and are handed
to the subsystems as h itself. The origin is the start, or the last event that lies between two such points. A shorter
step is taken only to an event or to the stop time.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

__all__ = ["Segment", "Segments", "segment_blocks", "segments"]

BLOCK = 4096  # most segments of one block: bounds the memory of what is ahead

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


class Segments(NamedTuple):
    """Segments that follow each other without an event between them.

    Attributes
    ----------
    lengths, ends : ndarray, shape (n,)
        As those of Segment [s].
    event : bool
        Whether inputs jump at the end of the last one.
    """

    lengths: np.ndarray
    ends: np.ndarray
    event: bool

    def segment(self, k: int) -> Segment:
        """Return one of them."""
        last = k == len(self.ends) - 1
        return Segment(float(self.lengths[k]), float(self.ends[k]), self.event and last)


def segments(
    start: float, stop: float, step: float | None, events: Iterable[float], marks: Iterable[float] = ()
) -> Iterator[Segment]:
    """Yield the segments of segment_blocks() one by one."""
    for block in segment_blocks(start, stop, step, events, marks):
        last = len(block.ends) - 1
        for k, (length, end) in enumerate(zip(block.lengths.tolist(), block.ends.tolist(), strict=True)):
            yield Segment(length, end, block.event and k == last)


def segment_blocks(
    start: float, stop: float, step: float | None, events: Iterable[float], marks: Iterable[float] = ()
) -> Iterator[Segments]:
    """Yield the segments from `start` to `stop` [s], in blocks.

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
            yield _single(time, target, stop, event)
            time = target
            continue
        count = round((target - origin) / step)
        on_grid = abs(origin + count * step - target) <= _tolerance(target, step)
        if not on_grid and origin + count * step > target:
            count -= 1
        while number < count:
            size = min(count - number, BLOCK)
            last = on_grid and number + size == count
            ends = origin + np.arange(number + 1, number + size + 1) * step
            if last and target == stop:
                ends[-1] = stop
            begins = np.concatenate([[time], ends[:-1]])
            lengths = np.full(size, step)
            for k in np.flatnonzero(begins + step > stop).tolist():
                lengths[k] = _within(float(begins[k]), step, stop)
            yield Segments(lengths, ends, event and last)
            number, time = number + size, float(ends[-1])
        if not on_grid:
            yield _single(time, target, stop, event)
            origin, number, time = target, 0, target


def _single(time: float, target: float, stop: float, event: bool) -> Segments:
    return Segments(np.array([_within(time, target - time, stop)]), np.array([target]), event)


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
