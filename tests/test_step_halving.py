"""The coupling's own error as macro steps are halved, co-simulation against the reference, the chart of the release."""

from __future__ import annotations

import math

import numpy as np
import pytest
import tca_cosim
from tca_cosim.benchmarks import work_precision
from tca_cosim.benchmarks.peers.table import PeerRow
from tca_cosim.benchmarks.work_precision.release import draw
from tca_cosim.errors import CouplingError
from tca_cosim.verification import reference


@pytest.mark.parametrize(
    ("scene", "overrides", "order"),
    [
        ("sine", [], 5.0),
        ("feedback", ["stop_time=6", "thermal.V[2]=0", "thermal.V[3]={ sine = { amplitude = 3, period = 40 } }"], 4),
        ("tap", ["stop_time=0.1", "rod.order=1"], 5.7),
        ("push", [], None),
    ],
)
def test_the_coupling_error_falls_to_1e9_of_the_range(scene: str, overrides: list[str], order: int | None) -> None:
    """What the voltages and loads do within a step is a cubic to the FMUs with their mean and first moment: order 6 to
    what is slow against a step, 4 to what is fast, and heat and rods have both. Where it is one, no error is left."""
    actual = work_precision.halve_steps(scene, overrides)
    assert actual["difference"][-1] <= 1e-9
    if order is None:
        assert actual.sizes["step"] == 2
    else:
        assert actual["order"][-2:].to_numpy() == pytest.approx([order] * 2, abs=0.3)


def test_heat_that_starts_at_once_costs_a_loop_two_orders() -> None:
    """After a jump of the voltage a temperature's rate goes with the root of time, and displacements, which the loop
    carries as cubics, go with it."""
    actual = work_precision.halve_steps("feedback", ["stop_time=6"], halvings=3)
    assert actual["order"][-2:].to_numpy() == pytest.approx([2.0] * 2, abs=0.1)


def test_steps_too_long_for_a_loop_are_left_behind_as_failed() -> None:
    actual = work_precision.halve_steps("stiff")
    assert np.isnan(actual["difference"][0])
    assert "make coupling.macro_step smaller" in actual["failure"][0].item()
    assert actual["difference"][-1] <= 1e-9
    with pytest.raises(CouplingError, match=r"gain 3\.2"):
        work_precision.halve_steps("plain", ["stop_time=1"], halvings=2)


def test_co_simulation_meets_the_reference_on_drop() -> None:
    """Refined both: 1e-4 of the length."""
    scene = tca_cosim.read("drop", ["stop_time=0.2", "rod.order=5"])
    fine = reference.Resolution(elements=2, degree=4, rtol=1e-4)
    actual = {gap.name: gap for gap in reference.compare(tca_cosim.run(scene), reference.run(scene, fine))}
    assert actual["rod.tip.p"].most < 1e-4 * 0.04 < 1e-3 * actual["rod.tip.p"].span
    assert actual["rod.delta"].most < 1e-6
    assert actual["thermal.T"].most < 5e-3


def test_the_release_is_drawn_with_what_was_unstable_at_the_edge() -> None:
    def row(code: str, dim: int, damped: bool, error: float, cpu: float) -> PeerRow:
        largest = error if error < 1e3 else math.inf
        times = {"cpu": cpu, "cpu_low": 0.9 * cpu, "cpu_high": 1.1 * cpu, "times_real_time": 1 / cpu}
        accuracy = {"setting": "", "every_10_ms": True, "error": error, "largest_error": largest}
        return PeerRow(code=code, dim=dim, damped=damped, **times, **accuracy)

    rows = [row("rod.fmu", 3, damped, error, 0.01 / error) for damped in (False, True) for error in (1.0, 10.0)]
    rows += [row("other", 2, False, 5e3, 1.0), row("other", 2, True, 10.0, 1.0)]
    figure = draw(rows, ["a machine"])
    undamped, damped = figure.axes
    assert [len([line for line in a.lines if line.get_marker() == "x"]) for a in (undamped, damped)] == [1, 0]
    assert figure.legends[0].get_texts()[-1].get_text() == "other, planar"
