"""Newton's method with tangents: a quasi-static rod tells how its displacements follow the guessed ones."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import tca_cosim as tca
from tca_cosim.fmi.archive import Archive, find_fmu
from tca_cosim.fmi.slave import Slave

T = ["T[1]", "T[2]", "T[3]"]
GUESS = ["delta_guess[1]", "delta_guess[2]", "delta_guess[3]"]
SEEN = ["delta[1]", "delta[2]", "delta[3]", "tip.p[1]", "N[2]"]


@pytest.fixture
def rod() -> Iterator[Slave]:
    parameters = {"dynamic": False, "closure": 2, "order": 2}
    with Archive(find_fmu("rod.fmu")) as archive:
        slave = Slave(archive, "rod", parameters, [*T, *GUESS], SEEN)
        slave.initialise(0.0, np.array([310.0, 300.0, 298.15, 0.0, 0.0, 0.0]))
        slave.begin()
        yield slave
        slave.close()


def answer(rod: Slave, guess: np.ndarray) -> np.ndarray:
    """What is seen after a step to T = (310, 300, 298.15) K and the guess [m]."""
    inputs = np.zeros((4, 6))
    inputs[0] = [310.0, 300.0, 298.15, *guess]
    rod.set_inputs(inputs)
    rod.step(0.0, 0.1)
    return rod.values()


def test_the_tangent_of_a_quasi_static_rod_is_that_of_its_steps(rod: Slave) -> None:
    start, guess, small = rod.save(), np.array([1e-3, 5e-4, -2e-4]), 1e-6
    expected = np.empty((5, 3))
    for column, change in enumerate(small * np.eye(3)):
        sides = []
        for sign in (1.0, -1.0):
            sides.append(answer(rod, guess + sign * change))
            rod.restore(start)
        expected[:, column] = (sides[0] - sides[1]) / (2.0 * small)
    seen = answer(rod, guess)
    actual = rod.tangent(np.array([3, 4, 5]))
    assert np.abs(actual[:3]).max() > 1.0  # plain iteration diverges
    np.testing.assert_allclose(actual, expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())
    assert (rod.values() == seen).all()


def sweeps(method: str, *overrides: str) -> tuple[np.ndarray, np.ndarray]:
    result = tca.run(tca.read("plain", ["stop_time=1", f"coupling.method={method}", *overrides]))
    return result["coupling.sweeps"].values[1:], result["rod.delta"].values[-1]


def test_newton_with_tangents_needs_no_sweeps_for_its_jacobian() -> None:
    with_tangent, differences = sweeps("tangent"), sweeps("newton")
    assert with_tangent[0][0] <= differences[0][0] - 3
    assert with_tangent[0].sum() < differences[0].sum()
    np.testing.assert_allclose(with_tangent[1], differences[1], rtol=0.0, atol=1e-8)


def test_a_rod_with_inertia_is_iterated_with_differences() -> None:
    """Its tangents are those of an instant, at which displacements do not follow yet."""
    moving = ("rod.dynamic=true", "rod.method=backward_euler", "coupling.macro_step=0.05", "stop_time=0.3")
    np.testing.assert_allclose(sweeps("tangent", *moving)[1], sweeps("newton", *moving)[1], rtol=0.0, atol=1e-8)
