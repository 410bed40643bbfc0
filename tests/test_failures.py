"""Scenes made to fail, or to make weak methods fail: each ends with a clear error, or with the right answer."""

from __future__ import annotations

import numpy as np
import pytest
import tca_cosim as tca


def test_plain_iteration_diverges_and_names_the_gain() -> None:
    """Theory for the quasi-static manipulator: -3.2 (stretch) and -1.6 (bending), whatever the macro step."""
    with pytest.raises(tca.CouplingError) as caught:
        tca.run(tca.read("plain"))
    assert caught.value.gain == pytest.approx(3.2, abs=0.1)
    assert "the iteration diverges" in str(caught.value)
    assert "iqn" in caught.value.remedy


def test_plain_iteration_converges_for_a_softer_tca() -> None:
    """10 N/m in place of 79.5: gains 0.40 and 0.20."""
    result = tca.run(tca.read("plain", ["parameters=measured", "stop_time=2"]))
    assert result["coupling.gain"][-1] == pytest.approx(0.404, abs=0.01)


def test_relaxation_has_its_edge_at_2_over_1_plus_gain() -> None:
    edge = 2.0 / (1.0 + 3.215)
    for omega, converges in ((0.95 * edge, True), (1.05 * edge, False)):
        settings = ["coupling.method=relaxed", f"coupling.omega={omega}", "coupling.max_sweeps=500", "stop_time=0.5"]
        scene = tca.read("plain", settings)
        if converges:
            assert tca.run(scene).attrs["status"] == "complete"
            continue
        with pytest.raises(tca.CouplingError):
            tca.run(scene)


def test_explicit_coupling_of_an_undamped_rod_ends_early() -> None:
    """Either the master sees how far off the guess is, or the rod that it whips up bends beyond its quadrature."""
    with pytest.raises(tca.CouplingError, match=r"explicit coupling is off|quadrature of this order") as caught:
        tca.run(tca.read("explicit"))
    partial = caught.value.partial
    assert 0.05 < partial["time"][-1] < 0.5
    assert np.isfinite(partial["rod.delta"]).all()


def test_explicit_quasi_static_coupling_ends_early_too() -> None:
    """Without inertia the explicit scheme multiplies errors by the loop gain in every step."""
    with pytest.raises(tca.CouplingError, match="explicit coupling is off"):
        tca.run(tca.read("step", ["coupling.method=none"]))


def test_tcas_a_hundred_times_stiffer() -> None:
    result, inside = tca.run(tca.read("stiff")), tca.run(tca.read("stiff", ["rod.closure=inside"]))
    assert result["coupling.gain"][-1] == pytest.approx(321.5, rel=1e-3)
    assert result["coupling.sweeps"][1:].mean() <= 2.5
    assert np.abs(result["rod.delta"] - inside["rod.delta"]).max() <= 1e-8


def test_long_steps_lose_nothing_that_the_heat_has_exactly() -> None:
    result, fine = tca.run(tca.read("long", ["stop_time=30 s"])), tca.run(tca.read("step"))
    np.testing.assert_allclose(result["thermal.T"][-1], fine["thermal.T"][-1], atol=1e-6)
    np.testing.assert_allclose(result["rod.delta"][-1], fine["rod.delta"][-1], atol=1e-8)


def test_a_jump_inside_a_step() -> None:
    result, fine = tca.run(tca.read("jump")), tca.run(tca.read("jump", ["coupling.macro_step=0.01"]))
    assert 7.03 in result["time"]
    np.testing.assert_allclose(result["thermal.T"][-1], fine["thermal.T"][-1], atol=1e-6)


def test_strong_feedback_is_of_second_order_in_the_macro_step() -> None:
    """delta travels as a line over a macro step, into heat that depends on its whole course."""
    ends = [
        tca.run(tca.read("feedback", [f"coupling.macro_step={step}", "coupling.tolerance=1e-8"]))["thermal.T"][-1]
        for step in (2.0, 1.0, 0.5)
    ]
    first, second = np.abs(ends[0] - ends[1]).max(), np.abs(ends[1] - ends[2]).max()
    assert np.log2(first / second) == pytest.approx(2.0, abs=0.3)
