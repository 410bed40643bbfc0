"""The first guess of a loop from the solutions of earlier macro steps."""

from __future__ import annotations

import numpy as np
import pytest
import tca_cosim
from tca_cosim.cosim.acceleration import KEPT, PastSolutions

TIMES = [0.0, 0.1, 0.25, 0.3, 0.5, 0.6]  # steps of several lengths
ONE = np.ones(1)


def after(values: list[float], times: list[float] = TIMES) -> PastSolutions:
    past = PastSolutions()
    past.begin_step(times[0], np.array(values[:1]))
    for time, value in zip(times[1:], values[1:], strict=True):
        past.add(time, np.array([value]))
    return past


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_polynomials_are_guessed_exactly(degree: int) -> None:
    polynomial = np.polynomial.Polynomial(np.arange(1.0, degree + 2.0))
    guess = after([polynomial(t) for t in TIMES]).guess(0.8, ONE)
    assert guess == pytest.approx([polynomial(0.8)], rel=1e-10)


@pytest.mark.parametrize(("count", "degree"), [(3, 2), (4, 2), (5, 3), (6, 4)])
def test_the_error_falls_with_the_degree_that_the_solutions_allow(count: int, degree: int) -> None:
    """The degree is one that could be tried on the newest solution; three solutions give a parabola."""
    errors = []
    for h in (0.02, 0.01):
        times = [k * h for k in range(count)]
        guess = after([float(np.exp(t)) for t in times], times).guess(count * h, ONE)
        assert guess is not None
        errors.append(abs(float(guess[0]) - float(np.exp(count * h))))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(degree + 1, abs=0.2)


def test_behind_a_kink_lines_guess_better_than_what_was_before() -> None:
    """abs(t - 0.35), whose last samples lie on a line."""
    times = [0.1 * k for k in range(KEPT)]
    values = [abs(t - 0.25) for t in times]
    assert after(values, times).guess(0.6, ONE) == pytest.approx([0.35])


def test_solutions_that_were_taken_back_are_dropped() -> None:
    past = after([t * t for t in TIMES])
    past.begin_step(0.3, np.array([7.0]))
    assert past.times == TIMES[:4]
    past.begin_step(0.4, np.array([7.0]))  # no solution is known there: the past begins anew
    assert past.times == [0.4]
    assert past.guess(0.5, ONE) is None


def test_no_more_than_a_quartic_needs_are_kept() -> None:
    past = after(list(range(10)), [float(k) for k in range(10)])
    assert past.times == [4.0, 5.0, 6.0, 7.0, 8.0, 9.0]
    assert len(past.values) == KEPT


@pytest.mark.parametrize(("scene", "most"), [("step", 1.2), ("sine", 1.2), ("load", 1.2)])
def test_smooth_scenes_take_one_sweep_in_most_steps(scene: str, most: float) -> None:
    result = tca_cosim.run(scene)
    assert result["coupling.sweeps"].to_numpy()[1:].mean() <= most
    assert result["coupling.error"].max() <= 1e-6


def test_a_jump_of_the_voltage_forgets_the_past() -> None:
    """Behind it there are few solutions, so that the next steps take two sweeps, as at the start."""
    jump = {"steps": [[0, 0], [5, 3]]}
    result = tca_cosim.run("step", {"thermal.V": [0, 1.5, jump], "stop_time": 10})
    sweeps = result["coupling.sweeps"].sel(time=slice(5.05, 5.25)).to_numpy()
    assert (sweeps >= 2).all()
    assert result["coupling.error"].max() <= 1e-6
