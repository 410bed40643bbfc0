"""A seeded sample of random loads; random_loads.py runs long campaigns by hand."""

from __future__ import annotations

import numpy as np
from fmu_host import FMU2Host, FMU2Model
from random_loads import ROD, campaign, distance_to_damped_motion, judged, write


def test_accepted_equilibria_are_where_damped_motion_ends() -> None:
    counts, wrong = campaign(40, 0)
    assert wrong == []
    assert counts["accepted"] == 40


def test_a_saddle_is_far_from_the_end_of_damped_motion() -> None:
    """The straight rod beyond its buckling load, which the side load bends."""
    with FMU2Host(ROD) as still, FMU2Host(ROD) as moving:
        write(still, 4, np.zeros(3), dynamic=False)
        still.step(0.0, 0.1)
        assert distance_to_damped_motion(still, moving, 4, np.array([1e-5, 0.0, -0.1])) > 0.01


def test_the_judge_sees_a_saddle_and_a_state_that_is_no_equilibrium() -> None:
    """The straight rod beyond its buckling load of 53 mN, and the straight rod under a force across it."""
    with FMU2Model(ROD) as model:
        strains = [n for row in model.derivative_rows if (n := row.derivative.name).startswith("strain[")]
        straight = [0.0] * len(strains)
        assert "unstable" in judged(model, 4, np.array([0.0, 0.0, -0.1]), strains, straight)[0]
        assert "no equilibrium" in judged(model, 4, np.array([0.01, 0.0, 0.0]), strains, straight)[0]
