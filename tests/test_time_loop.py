"""The loop over macro steps with a scripted control: steps after success, failure, events and ends."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tca_cosim.cosim.node import MacroStep
from tca_cosim.cosim.step_control import StepResult
from tca_cosim.cosim.step_error import StepError, give_up
from tca_cosim.cosim.time_loop import drive
from tca_cosim.errors import CouplingError


@dataclass
class Script:
    """A control that does what `answer` says, and remembers the steps that it was asked for."""

    answer: Callable[[MacroStep, int], StepResult]
    step: float = 1.0
    equidistant: bool = True
    asked: list[MacroStep] = field(default_factory=list)

    def attempt(self, master: Any, step: MacroStep) -> StepResult:
        self.asked.append(step)
        return self.answer(step, len(self.asked))

    @property
    def lengths(self) -> list[float]:
        return [step.length for step in self.asked]


def log(time: float) -> Any:
    return SimpleNamespace(time=time)


def accepted(step: MacroStep, wish: float = 1.0) -> StepResult:
    return StepResult((log(step.end),), wish)


def failing(attempts: Sequence[int], **failure: Any) -> Callable[[MacroStep, int], StepResult]:
    """Answer with a failure at some attempts, counted from 1."""

    def answer(step: MacroStep, attempt: int) -> StepResult:
        if attempt in attempts:
            raise StepError("refused", **failure)
        return accepted(step)

    return answer


def master(halvings: int = 3) -> Any:
    return SimpleNamespace(
        settings=SimpleNamespace(halvings=halvings, method="iqn"), notes=[], ended=None, arrivals=[], arrive=None
    )


def ends(control: Script, stop: float, one: Any = None, **more: Any) -> list[float]:
    one = one or master()
    one.arrive = one.arrivals.append
    return [each.time for each in drive(one, control, 0.0, stop, **more)]


def test_steps_of_one_length_and_a_last_one_that_is_shorter_with_a_note() -> None:
    control, one, seen = Script(lambda step, n: accepted(step, 0.4), step=0.4), master(), []
    assert ends(control, 1.0, one, progress=seen.append) == [0.4, 0.8, 1.0]
    assert control.lengths == pytest.approx([0.4, 0.4, 0.2])
    assert seen == [0.4, 0.8, 1.0]
    assert len(one.notes) == 1
    assert "the last step is 0.2 s: steps of 0.4 s do not end at the stop time 1 s" in one.notes[0]


def test_no_note_where_steps_end_at_the_stop_time_or_adapt() -> None:
    one = master()
    assert ends(Script(lambda step, n: accepted(step)), 3.0, one) == [1.0, 2.0, 3.0]
    ends(Script(lambda step, n: accepted(step, 0.4), step=0.4, equidistant=False), 1.0, one)
    assert one.notes == []


def test_a_failed_step_is_halved_and_the_length_grows_back() -> None:
    control = Script(failing([1, 2]))
    assert ends(control, 3.0) == [0.25, 0.625, 1.0, 2.0, 3.0]  # 0.75 are left of the first, in two of at most 0.5
    assert control.lengths == [1.0, 0.5, 0.25, 0.375, 0.375, 1.0, 1.0]


@pytest.mark.parametrize(
    ("reached", "retried"),
    [(0.3, 0.25), (0.9, 1.0 / 2.0), (0.95, 0.5), (0.05, 0.5), (None, 0.5), (0.5, 0.5), (0.125, 0.125)],
    ids=["divided evenly", "at the ratio", "too close", "too short", "unknown", "half", "the least"],
)
def test_a_retry_goes_as_far_as_the_subsystem_came(reached: float | None, retried: float) -> None:
    """Parts of a step are equal: what is left of 1 s is divided into as many as the cap asks for."""
    control = Script(failing([1], reached=reached))
    ends(control, 1.0)
    assert control.lengths[1] == pytest.approx(retried)


def test_a_long_step_whose_reach_is_unknown_is_halved() -> None:
    control = Script(lambda step, n: failing([1])(step, n), step=4.0)
    ends(control, 4.0)
    assert control.lengths[:2] == [4.0, 2.0]


def test_a_step_that_fails_at_every_length_ends_the_run() -> None:
    control = Script(failing(range(1, 99), residuals=(1.0, 0.5), gain=0.5))
    with pytest.raises(CouplingError, match="refused") as error:
        ends(control, 1.0, master(halvings=3))
    assert control.lengths == [1.0, 0.5, 0.25, 0.125]
    assert (error.value.time, error.value.step) == (0.0, 0.125)
    assert "Raise coupling.halvings" in str(error.value)


def test_a_part_that_cannot_be_taken_back_is_kept() -> None:
    control = Script(failing([2], log=log(1.7)))
    assert ends(control, 2.0) == [1.0, 1.7, 1.5, 2.0]


# -- ends that an FMU asks for


def stopping(at: float, first: int = 1) -> Callable[[MacroStep, int], StepResult]:
    """An FMU that goes no further than a time."""

    def answer(step: MacroStep, attempt: int) -> StepResult:
        if step.end > at:
            raise StepError("the FMU ends", termination=True, reached=at)
        return accepted(step)

    return answer


def test_an_end_within_a_step_is_hit_exactly() -> None:
    control, one = Script(stopping(1.4)), master()
    assert ends(control, 5.0, one) == [1.0, 1.4]
    assert [(step.time, step.end) for step in control.asked] == [(0.0, 1.0), (1.0, 2.0), (1.0, 1.4), (1.4, 2.0)]
    assert control.asked[2].length == pytest.approx(0.4)
    assert one.ended == "the FMU ends"


def test_an_end_at_the_start_of_a_step_but_for_rounding_is_there_already() -> None:
    control, one = Script(stopping(1.0 + 1e-10), step=1.0), master()
    assert ends(control, 5.0, one) == [1.0]
    assert len(control.asked) == 2
    assert one.ended == "the FMU ends"


def test_an_end_soon_after_the_start_of_a_short_step_is_hit() -> None:
    control, one = Script(lambda step, n: stopping(0.01 + 1e-8)(step, n), step=0.01), master()
    assert ends(control, 1.0, one) == [0.01, 0.01 + 1e-8]
    assert one.ended == "the FMU ends"


def test_an_end_that_is_refused_itself_is_the_end() -> None:
    def answer(step: MacroStep, attempt: int) -> StepResult:
        if step.time < 1.0:
            return accepted(step)
        raise StepError("ends" if attempt == 2 else "fails", termination=attempt == 2, reached=1.5)

    control, one = Script(answer), master()
    assert ends(control, 5.0, one) == [1.0]
    assert one.ended == "fails"


def test_an_end_whose_time_is_unknown_is_now() -> None:
    control, one = Script(failing([2], termination=True)), master()
    assert ends(control, 5.0, one) == [1.0]
    assert one.ended == "refused"


# -- events, wishes, blocks


def test_events_are_hit_and_announced() -> None:
    control, one = Script(lambda step, n: accepted(step)), master()
    assert ends(control, 3.0, one, breaks=[1.5]) == [1.0, 1.5, 2.5, 3.0]
    assert one.arrivals == [1.5]


def test_an_adaptive_control_gets_what_it_wishes_in_equal_parts() -> None:
    wishes = iter([0.5, 0.2, 0.6, 9.0, 9.0])
    control = Script(lambda step, n: accepted(step, next(wishes)), step=0.25, equidistant=False)
    ends(control, 2.0)
    lengths = [0.25, 1.75 / 4, (1.75 - 1.75 / 4) / 7]  # wishes of 0.25, 0.5, 0.2 s
    assert control.lengths[:3] == pytest.approx(lengths)
    assert control.asked[-1].end == 2.0


def test_a_rejected_attempt_takes_no_time() -> None:
    def answer(step: MacroStep, attempt: int) -> StepResult:
        return StepResult((), 0.5) if attempt == 1 else accepted(step, 0.5)

    control = Script(answer, equidistant=False)
    assert ends(control, 1.0) == [0.5, 1.0]
    assert [step.time for step in control.asked] == [0.0, 0.0, 0.5]


@dataclass
class Blocks:
    """Takes `most` steps of what it is given, at most `size` at once."""

    size: int = 4
    most: int = 4
    given: list[list[MacroStep]] = field(default_factory=list)

    def take(self, times: np.ndarray, lengths: np.ndarray, ends: np.ndarray) -> list[Any]:
        columns = (times.tolist(), lengths.tolist(), ends.tolist())
        self.given.append([MacroStep(*step) for step in zip(*columns, strict=True)])
        return [log(end) for end in columns[2][: self.most]]


def test_blocks_take_steps_up_to_an_event() -> None:
    control, one, blocks, seen = Script(lambda step, n: accepted(step)), master(), Blocks(), []
    assert ends(control, 6.0, one, breaks=[3.0], blocks=blocks, progress=seen.append) == [1, 2, 3, 4, 5, 6]
    assert [len(steps) for steps in blocks.given] == [3, 3]
    assert [step.time for step in blocks.given[1]] == [3.0, 4.0, 5.0]
    assert control.asked == []
    assert one.arrivals == [3.0]
    assert seen == [1, 2, 3, 4, 5, 6]


def test_a_block_ends_at_an_event_at_once() -> None:
    control, blocks = Script(lambda step, n: accepted(step)), Blocks()
    assert ends(control, 3.0, blocks=blocks, breaks=[1.0]) == [1, 2, 3]
    assert [[step.end for step in steps] for steps in blocks.given] == [[1], [2, 3]]


def test_what_a_block_leaves_comes_again() -> None:
    control, blocks = Script(lambda step, n: accepted(step)), Blocks(size=4, most=1)
    assert ends(control, 3.0, blocks=blocks) == [1, 2, 3]
    assert [[step.end for step in steps] for steps in blocks.given] == [[1, 2, 3], [2, 3], [3]]


def test_a_block_that_takes_nothing_leaves_the_step_to_the_master() -> None:
    control, blocks = Script(lambda step, n: accepted(step)), Blocks(size=2, most=0)
    assert ends(control, 2.0, blocks=blocks) == [1, 2]
    assert control.lengths == [1.0, 1.0]


def test_blocks_wait_until_the_length_has_grown_back() -> None:
    """Failures late in a step leave lengths of at most 0.5 s to the next one, which is the master's."""
    control, blocks = Script(failing([1, 3, 5])), Blocks(size=1, most=0)
    assert ends(control, 3.0, blocks=blocks) == [0.5, 0.75, 0.875, 1.0, 1.5, 2.0, 3.0]
    assert [steps[0].time for steps in blocks.given] == [0.0, 2.0]


# -- the error that ends a run


@pytest.mark.parametrize(
    ("failure", "method", "words"),
    [
        ({"gain": 1.0}, "iqn", "bends too much within this step for coupling.method = 'iqn', as where contact sets in"),
        ({"gain": 1.0}, "newton", "; coupling.method = 'iqn' searches near such bends"),
        ({"gain": 1.0}, "plain", "'relaxed' with omega below 1,"),
        ({"gain": 3.0}, "relaxed", "'relaxed' with omega below 0.5,"),
        ({"gain": 0.99, "residuals": (1.0,)}, "plain", "coupling.tolerance, or use coupling.method = 'iqn'"),
        ({"gain": 0.99, "residuals": (1.0,), "remedy": "Do so"}, "plain", "Do so"),
        ({"residuals": (1.0,)}, "newton", "coupling.max_sweeps or coupling.tolerance"),
        ({}, "newton", "Follow what the subsystem says, or make coupling.macro_step smaller"),
    ],
)
def test_the_remedy_is_that_of_gain_and_method(failure: dict[str, Any], method: str, words: str) -> None:
    error = give_up(1.5, 0.1, StepError("it failed", **failure), method)
    assert words in str(error)
    assert (error.time, error.step, error.sweeps) == (1.5, 0.1, len(failure.get("residuals", ())))
    assert math.isnan(error.gain) == ("gain" not in failure)
    assert ("iqn'" in str(error)) == ("iqn'" in words or (failure.get("gain", 0.0) >= 1.0))
