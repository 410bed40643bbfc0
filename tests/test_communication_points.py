"""Communication points: k h to the last bit, shorter steps only where an event or the stop time asks for one."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
from fmu_maker import make_fmu, real
from tca_cosim.cosim.communication_points import segments


def ends_and_lengths(*arguments: object) -> tuple[np.ndarray, np.ndarray]:
    actual = list(segments(*arguments))
    return np.array([segment.end for segment in actual]), np.array([segment.length for segment in actual])


@pytest.mark.parametrize(("step", "count"), [(1e-3, 20_000), (1e-3, 1_000_000), (0.1, 12_345)])
def test_equal_steps_are_multiples_to_the_last_bit(step: float, count: int) -> None:
    ends, lengths = ends_and_lengths(0.0, step * count, step, ())
    np.testing.assert_array_equal(ends, np.arange(1, count + 1) * step)
    assert set(lengths[:-1]) == {step}
    assert lengths[-1] == pytest.approx(step, rel=1e-9)


def test_a_start_other_than_zero() -> None:
    ends, lengths = ends_and_lengths(1.7, 2.7, 0.1, ())
    np.testing.assert_array_equal(ends[:-1], 1.7 + np.arange(1, 10) * 0.1)
    assert ends[-1] == 2.7
    assert set(lengths[:-1]) == {0.1}


def test_late_times_are_the_same_but_for_their_rounding() -> None:
    """At 1e7 s two times that are one differ by 2e-9 s, more than a share of the step allows."""
    ends, _ = ends_and_lengths(10000000.1, 10000000.7, 0.1, (10000000.4,))
    assert len(ends) == 6
    assert ends[-1] == 10000000.7


def test_a_step_that_does_not_divide_the_stop_time_leaves_a_shorter_last_one() -> None:
    ends, lengths = ends_and_lengths(0.0, 0.5, 0.2, ())
    np.testing.assert_array_equal(ends, [0.2, 0.4, 0.5])
    np.testing.assert_allclose(lengths, [0.2, 0.2, 0.1], rtol=1e-15)


def test_steps_begin_anew_after_an_event() -> None:
    ends, lengths = ends_and_lengths(0.0, 1.0, 0.3, (0.4,))
    np.testing.assert_allclose(ends, [0.3, 0.4, 0.7, 1.0], rtol=1e-15)
    np.testing.assert_allclose(lengths, [0.3, 0.1, 0.3, 0.3], rtol=1e-15)
    assert [segment.event for segment in segments(0.0, 1.0, 0.3, (0.4,))] == [False, True, False, False]


def test_an_event_at_a_communication_point_moves_none() -> None:
    """0.3 is not 3 * 0.1 to the last bit, nor is 0.30000000000000004 another event."""
    actual = list(segments(0.0, 1.0, 0.1, (0.3, 0.1 + 0.2, 0.7), (0.3,)))
    assert len(actual) == 10
    np.testing.assert_array_equal([s.end for s in actual[:-1]], np.arange(1, 10) * 0.1)
    assert [k for k, s in enumerate(actual, 1) if s.event] == [3, 7]


def test_events_at_the_ends_are_none() -> None:
    assert not any(segment.event for segment in segments(0.0, 1.0, 0.1, (0.0, 1e-13, 1.0 - 1e-13, 1.0, 2.0)))


def test_marks_end_steps_without_an_event() -> None:
    actual = list(segments(0.0, 1.0, None, (0.5,), (0.25, 0.5)))
    assert [(s.end, s.event) for s in actual] == [(0.25, False), (0.5, True), (1.0, False)]


@pytest.mark.parametrize(
    ("stop", "step"),
    [(1.0, 0.1), (10.0, 0.1), (3.0, 0.01), (7.7, 0.3), (0.3, 0.1), (1e5, 333.3), (0.7, 0.1), (2.1, 0.3), (1e-3, 1.0)],
)
def test_no_step_ends_beyond_the_stop_time(stop: float, step: float) -> None:
    time = 0.0
    for segment in segments(0.0, stop, step, ()):
        assert time + segment.length <= stop
        assert time < segment.end <= stop
        time = segment.end
    assert time == stop


def test_random_events_leave_no_slivers() -> None:
    random = np.random.default_rng(3)
    for _ in range(200):
        step = float(random.uniform(0.01, 0.3))
        events = [float(t) for t in (random.integers(0, 40, 5) * step, random.uniform(0, 3, 3)) for t in t]
        ends, lengths = ends_and_lengths(0.0, 3.0, step, events)
        assert (lengths > 1e-9 * step).all()
        assert (lengths <= step).all()
        assert np.diff(ends).min() > 0.0
        for event in (t for t in events if 1e-6 < t < 3.0 - 1e-6):
            assert np.abs(ends - event).min() <= 1e-9 * step


def run(tmp_path: Path, text: str) -> object:
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    return tca.run(tca.read(tmp_path / "scene.toml"))


def test_an_fmu_of_equal_steps_takes_twenty_thousand(tmp_path: Path) -> None:
    """It counts samples at multiples of 1 ms by its own clock: one in every step."""
    make_fmu(
        tmp_path / "sampler.fmu",
        [real("samples"), real("now")],
        step="while ((memory[0] + 1) * 0.001 <= t + h + 1e-9) memory[0] += 1; memory[1] = t + h;",
        output="real[0] = memory[0]; real[1] = memory[1];",
        co_simulation={"canHandleVariableCommunicationStepSize": "false"},
    )
    result = run(
        tmp_path,
        'stop_time = 20\nconnections = []\n[fmus]\na = "sampler.fmu"\n[coupling]\nmacro_step = "1 ms"\n',
    )
    assert result.attrs["status"] == "complete"
    np.testing.assert_array_equal(result["time"], np.arange(20_001) * 0.001)
    np.testing.assert_array_equal(result["a.samples"], np.arange(20_001))
    assert json.loads(result.attrs["notes"]) == []
    statistics = json.loads(result.attrs["statistics"])
    assert (statistics["steps"], statistics["rejected_steps"]) == (20_000, 0)


def test_an_fmu_with_a_sample_time_sees_its_multiples_and_the_last_short_step_is_said(tmp_path: Path) -> None:
    make_fmu(
        tmp_path / "sampled.fmu",
        [real("u", "input", start=0), real("y")],
        step="""int samples = (int)floor((t + h) / 0.1 + 1e-6);
while ((int)memory[0] < samples) memory[0] += 1;
double part = h / 0.1 - floor(h / 0.1 + 0.5);
if (fabs(part) > 1e-6) { LOG(fmi2Error, "%g s: no multiple of 0.1 s", h); return fmi2Error; }""",
        output="real[1] = memory[0];",
    )
    text = 'stop_time = 0.5\nconnections = []\n[fmus]\na = "sampled.fmu"\n[coupling]\nmacro_step = 0.2\n'
    result = run(tmp_path, text)
    np.testing.assert_allclose(result["coupling.step"], [0.0, 0.2, 0.2, 0.1], rtol=1e-15)
    assert result["a.y"][-1] == 5.0
    (note,) = json.loads(result.attrs["notes"])
    assert "the last step is 0.1 s" in note


@pytest.mark.parametrize(("stop", "step"), [(7.7, 0.3), (0.3, 0.1), (1e5, 333.3), (2.1, 0.3)])
def test_an_fmu_that_refuses_to_pass_the_stop_time(stop: float, step: float, tmp_path: Path) -> None:
    make_fmu(
        tmp_path / "strict.fmu",
        [real("y")],
        step="""if (t + h > m->stop_time) { LOG(fmi2Error, "%.17g is beyond the stop time", t + h); return fmi2Error; }
if (fabs(t - memory[1]) > 1e-12 * fmax(1.0, fabs(t))) { LOG(fmi2Error, "I am at %.17g", memory[1]); return fmi2Error; }
memory[1] = t + h; memory[0] += 1;""",
        output="real[0] = memory[0];",
    )
    scene = f'stop_time = {stop}\nconnections = []\n[fmus]\na = "strict.fmu"\n[coupling]\nmacro_step = {step}\n'
    result = run(tmp_path, scene)
    assert result.attrs["status"] == "complete"
    assert result["a.y"][-1] == math.ceil(stop / step - 1e-9)
