"""A seeded sample of random loads; random_loads.py runs long campaigns by hand."""

from __future__ import annotations

import numpy as np
from fmu_host import FMU2Model
from random_loads import ROD, campaign, judged


def test_accepted_equilibria_are_stable_equilibria_of_the_moving_rod() -> None:
    counts, wrong = campaign(40, 0)
    assert wrong == []
    assert counts["accepted"] > 20


def test_the_judge_sees_a_saddle_and_a_state_that_is_no_equilibrium() -> None:
    """The straight rod beyond its buckling load of 53 mN, and the straight rod under a force across it."""
    with FMU2Model(ROD) as model:
        strains = [n for row in model.derivative_rows if (n := row.derivative.name).startswith("strain[")]
        straight = [0.0] * len(strains)
        assert "unstable" in judged(model, 4, np.array([0.0, 0.0, -0.1]), strains, straight)[0]
        assert "no equilibrium" in judged(model, 4, np.array([0.01, 0.0, 0.0]), strains, straight)[0]
