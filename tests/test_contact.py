"""Contact that sets in within a step: loops with a kink, whose solutions are known in closed form."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from tca_cosim.cosim.acceleration import IterationHistory, Outcome, create, solve
from tca_cosim.cosim.interface import InterfaceVector, TornOutputs
from tca_cosim.cosim.linear_subsystem import Linear
from tca_cosim.cosim.subsystem import Port
from tca_cosim.studies.stability.model_problems import couple, linear, wires

TOLERANCE = 1e-9
MOST_SWEEPS = 30  # default of coupling.max_sweeps


def iterate(sweep: Callable[[np.ndarray], np.ndarray], *guesses: list[float], limit: int = MOST_SWEEPS) -> Outcome:
    """Outcome of the last of several macro steps, one for each guess, with quasi-Newton."""
    history = IterationHistory(len(guesses[0]))
    for guess in guesses:
        outcome = solve(sweep, np.array(guess), np.ones(len(guess)), create("iqn"), history, TOLERANCE, limit)
    return outcome


@pytest.mark.parametrize("stiffness", 10.0 ** np.arange(6))
@pytest.mark.parametrize("guess", [0.0, 0.5, 0.9, 1.1, 2.0, 10.0, -3.0])
def test_a_finger_on_a_unilateral_spring(stiffness: float, guess: float) -> None:
    """Force k max(0, p - c F) of a spring that a finger of compliance c = 1 presses by p = 1 less what the force moves
    it: F = k p/(1 + k c). Guesses beyond p/c lift the finger off, where the slope of the residual is
    -1 instead of -1 - k c."""
    outcome = iterate(lambda force: stiffness * np.maximum(0.0, 1.0 - force), [guess])
    assert outcome.converged
    assert outcome.x[0] == pytest.approx(stiffness / (1.0 + stiffness), abs=2.0 * TOLERANCE)


def test_secants_across_the_onset_alone_would_take_a_sweep_for_each_unit_of_stiffness() -> None:
    """The guess, no force and the guess between them would follow each other 2 k c times."""
    count = len(iterate(lambda force: 1e4 * np.maximum(0.0, 1.0 - force), [2.0]).residuals)
    assert count <= 10


def squeezed(stiffness: float, pushes: np.ndarray, support: float) -> tuple[Callable, np.ndarray]:
    """Two fingers of compliance 1 squeeze an object on a spring: the sweep of their forces, and these from the four
    linear cases, of which one is consistent with itself."""
    compliance = np.eye(2) + np.array([[1.0, -1.0], [-1.0, 1.0]]) / support
    for touching in product((0.0, 1.0), repeat=2):
        chosen = stiffness * np.diag(touching)
        forces = np.linalg.solve(np.eye(2) + chosen @ compliance, chosen @ pushes)
        if ((pushes - compliance @ forces > 0.0) == np.array(touching, dtype=bool)).all():
            break
    return lambda x: stiffness * np.maximum(0.0, pushes - compliance @ x), forces


@pytest.mark.parametrize("stiffness", [10.0, 100.0, 1e3])
def test_two_fingers_that_squeeze_an_object(stiffness: float) -> None:
    """Guesses of a step in which neither, one or both touch begin with secants of a step in which none does."""
    rng, sweeps = np.random.default_rng(0), []
    for _ in range(50):
        sweep, forces = squeezed(stiffness, rng.uniform(-0.5, 1.0, 2), rng.uniform(0.1, 10.0))
        outcome = iterate(sweep, [2.0, 2.0], rng.uniform(0.0, 2.0, 2).tolist(), limit=60)
        assert outcome.converged
        np.testing.assert_allclose(outcome.x, forces, atol=1e-8)
        sweeps.append(len(outcome.residuals))
    assert np.mean(sweeps) < 12.0


def test_a_bend_between_two_slopes_at_which_newton_s_method_cycles() -> None:
    """Residual -x - 2 tanh(20 x), as of a finger that leaves a contact within a step: Newton's method cycles between
    points far out; bisection comes near enough."""
    for guess in np.linspace(-2.0, 2.0, 21):
        outcome = iterate(lambda x: -2.0 * np.tanh(20.0 * x), [guess])
        assert outcome.converged
        assert abs(outcome.x[0]) <= 2.0 * TOLERANCE


class Wall(Linear):
    """A spring that pushes where x < 0 and does not pull: F = k max(0, -x)."""

    def values(self) -> np.ndarray:
        """Return the force (1,)."""
        return np.maximum(0.0, super().values())


@pytest.mark.parametrize("kappa", [0.5, 10.0, 1e3, 1e5])
@pytest.mark.parametrize("method", ["iqn", "newton"])
def test_a_mass_falls_on_a_unilateral_spring(kappa: float, method: str) -> None:
    """Held forces: F = max(0, -k (x + H v))/(1 + kappa/2) at the end of each step, kappa = k H^2/m, so that every step
    is known from the one before. No step is taken back, at any stiffness."""
    step, count = 0.1, 60
    stiffness = kappa / step**2
    mass = linear("mass", [[0, 1], [0, -0.2]], [0, 1], [1, 0], [0], [0.35, -1.0], "F", "x")
    wall = linear("wall", [], [], [], [-stiffness], [], "x", "F", Wall)
    systems, connections = [mass, wall], wires("mass.x -> wall.x", "wall.F -> mass.F")
    flow, gain = mass._flow(step)[:2, :2], mass._flow(step)[:2, 2]
    master, logs = couple(
        systems,
        connections,
        count * step,
        step,
        method,
        "held",
        tolerance=1e-8,
        halvings=0,
        observe=lambda: np.array([*mass.state, *wall.values()]),
    )
    state, expected = mass.start, []
    for _ in range(count):
        free = flow @ state
        force = max(0.0, -stiffness * free[0]) / (1.0 + stiffness * gain[0])
        state = free + gain * force
        expected.append([*state, force])
    assert len(logs) == count
    assert master.rejected == 0
    scale = np.abs(expected).max(axis=0)
    np.testing.assert_allclose([log.record for log in logs] / scale, expected / scale, atol=1e-7)
    assert np.mean([log.sweeps for log in logs]) < 4.0


def test_a_nominal_of_a_value_that_was_zero_shrinks_to_what_comes() -> None:
    """Values 1 and 0, then 1 and 1e-5, which the second nominal follows, as those of values seen before do not."""
    node = SimpleNamespace(
        subsystem=SimpleNamespace(outputs=(Port("a", has_nominal=False), Port("b", has_nominal=False)))
    )
    interface = InterfaceVector([TornOutputs(node, np.arange(2), np.ones(2))], [False])
    assert interface.adapt(np.array([1.0, 0.0]))
    assert interface.scale.tolist() == [1.0, 1.0]
    assert not interface.adapt(np.array([1.0, 1e-12]))  # noise of the other
    assert interface.adapt(np.array([1.0, 1e-5]))
    assert interface.scale.tolist() == [1.0, 1e-5]
    assert not interface.adapt(np.array([2.0, 2e-5]))
