"""From the start to the stop time: events are hit exactly, failed steps are halved and retried."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Protocol

import numpy as np

from .communication_points import TIME_RTOL, Segment, Segments, segment_blocks
from .master import Master, StepLog
from .node import MacroStep
from .step_control import Control
from .step_error import StepError, give_up

__all__ = ["BlockStepper", "drive", "drive_parts"]

RETRY_RATIO = 0.9  # largest ratio of a retried step to the failed one; closer to 1 it would fail again, without end


class BlockStepper(Protocol):
    """Takes many macro steps at once, as the master would one by one."""

    @property
    def size(self) -> int:
        """Number of steps to ask for now; 0 where the master has to take the next one."""

    def take(self, times: np.ndarray, lengths: np.ndarray, ends: np.ndarray) -> Sequence[StepLog]:
        """Take steps from the first on, as many as succeed at once; the master is as if it had taken them.

        times, lengths, ends: of the steps (n,) [s], without an event between them.
        """


def drive(
    master: Master,
    control: Control,
    start: float,
    stop: float,
    breaks: Iterable[float] = (),
    progress: Callable[[float], None] = lambda time: None,
    marks: Iterable[float] = (),
    blocks: BlockStepper | None = None,
) -> Iterator[StepLog]:
    """Yield the log of every accepted macro step, as drive_parts() does."""
    for part in drive_parts(master, control, start, stop, breaks, progress, marks, blocks):
        yield from part


def drive_parts(
    master: Master,
    control: Control,
    start: float,
    stop: float,
    breaks: Iterable[float] = (),
    progress: Callable[[float], None] = lambda time: None,
    marks: Iterable[float] = (),
    blocks: BlockStepper | None = None,
) -> Iterator[Sequence[StepLog]]:
    """Yield the logs of accepted macro steps, of one or more at once; what was yielded stays valid after an error.

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
    blocks : BlockStepper or None
        Takes steps of one length in the master's place where it can. Only with a control that does not adapt them.

    Raises
    ------
    CouplingError, SubsystemError
        Where halving a step does not help.
    """
    time, wish, cap = start, control.step, math.inf
    termination: float | None = None  # when an FMU that refused a step wants to end [s]
    least = control.step * 0.5**master.settings.halvings
    ahead = _Lookahead(segment_blocks(start, stop, control.step if control.equidistant else None, breaks, marks))
    for segment in ahead:
        if blocks is not None and min(wish, cap) >= control.step and (size := blocks.size):
            lengths, ends = ahead.from_present(size)
            logs = blocks.take(np.concatenate([[time], ends[:-1]]), lengths, ends)
            if len(logs):
                yield logs
                segment = ahead.skip(len(logs) - 1)
                for time in ends[: len(logs)].tolist():
                    progress(time)
        remaining = segment.length
        while time < segment.end:
            parts = max(1, math.ceil(remaining / min(wish, cap) - TIME_RTOL))
            length = remaining / parts
            step = MacroStep(time, length, segment.end if parts == 1 else time + length)
            if termination is not None:
                step = MacroStep(time, termination - time, termination)
            try:
                result = control.attempt(master, step)
            except StepError as failure:
                if failure.termination and termination is None and failure.log is None:
                    # An FMU ends the simulation: the next step goes to that time exactly.
                    termination = time if failure.reached is None else failure.reached
                    if termination - time > TIME_RTOL * step.length:
                        continue
                if failure.log is not None:
                    yield [failure.log]
                if failure.termination or termination is not None:
                    master.ended = failure.cause
                    return
                cap = _shorter(step, failure.reached, least)
                if cap < least * (1.0 - TIME_RTOL):
                    raise give_up(time, length, failure, master.settings.method) from failure
                continue
            wish = result.next_length
            if result.steps:
                yield result.steps
                cap *= 2.0
                time = step.end
                termination = None
                remaining = segment.end - time
                progress(time)
        if segment.event:
            master.arrive(time)
    if control.equidistant and segment.length < control.step * (1.0 - TIME_RTOL):
        master.notes.append(
            f"the last step is {segment.length:.6g} s: steps of {control.step:.6g} s do not end at the stop time "
            f"{stop:.6g} s"
        )


class _Lookahead:
    """Segments one by one, of which the present one and those behind it can be seen at once."""

    def __init__(self, source: Iterator[Segments]) -> None:
        self._source = source
        self._block = Segments(np.zeros(0), np.zeros(0), False)
        self._present = -1  # number of the present segment in its block

    def __iter__(self) -> _Lookahead:
        return self

    def __next__(self) -> Segment:
        self._present += 1
        while self._present >= len(self._block.ends):
            self._block, self._present = next(self._source), 0
        return self._block.segment(self._present)

    def from_present(self, size: int) -> tuple[np.ndarray, np.ndarray]:
        """Return lengths and ends [s] of the present segment and those behind it, at most `size` without an event."""
        chosen = slice(self._present, self._present + size)
        return self._block.lengths[chosen], self._block.ends[chosen]

    def skip(self, count: int) -> Segment:
        """Make a later one of those the present segment, and return it."""
        self._present += count
        return self._block.segment(self._present)


def _shorter(step: MacroStep, reached: float | None, least: float) -> float:
    """Return the length [s] to retry with: as far as a subsystem came if that is a useful step, else half."""
    came = 0.0 if reached is None else reached - step.time
    return came if least <= came <= RETRY_RATIO * step.length else 0.5 * step.length
