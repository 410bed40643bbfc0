"""Measured TCAs and a measured bending module against the rod FMU, by the script that draws the figures."""

from __future__ import annotations

import numpy as np
import pytest
from fmu_host import ROOT
from scipy.optimize import minimize
from test_docs import load

bodies = load("bodies")


def test_the_measured_law_says_all_lengths() -> None:
    """One set of parameters for loads of 0 to 50 g and 30 to 148 degC."""
    temperatures, lengths = bodies.measured_lengths()
    computed = [bodies.hanging_lengths(temperatures, 1e-3 * grams) for grams in range(50, -1, -10)]
    gaps = np.array(computed).T - lengths
    assert np.isfinite(gaps).sum() > 70
    assert np.sqrt(np.nanmean(gaps**2)) < 0.6e-3
    assert np.nanmax(np.abs(gaps)) < 2.5e-3


def test_the_bending_module_and_what_no_law_can_say() -> None:
    """The computed angles of the module, and a bound on what any law of the TCAs could reach.

    Equal power bends by 10 degrees at 0.2 W and by 11 at 0.4 W, so the free strokes of these powers are nearly equal;
    then the two together, at 120 degrees, bend by sqrt(a^2 + b^2 - a b), about 10.5 degrees. Measured are 25."""
    computed, measured = bodies.module_angles(**bodies.MODULE), bodies.module_measured()
    gaps = np.array(computed) - np.array(measured)
    assert np.sqrt((gaps**2).mean()) == pytest.approx(9.1, abs=0.3)
    assert np.abs(gaps).max() == pytest.approx(18.4, abs=0.5)
    (equal_low, both, *_), (equal_high, *_) = measured[0]

    def largest(strokes: np.ndarray) -> float:
        a, b = strokes
        return max(abs(a - equal_low), abs(b - equal_high), abs(np.sqrt(a * a + b * b - a * b) - both))

    best = min(minimize(largest, start, method="Nelder-Mead").fun for start in ([10, 11], [17, 18], [5, 20], [20, 5]))
    assert best == pytest.approx(7.3, abs=0.1)


def test_the_figures_are_there() -> None:
    for name in ("measured_law", "holding", "module"):
        assert (ROOT / "docs" / "figures" / f"{name}.png").stat().st_size > 10_000
