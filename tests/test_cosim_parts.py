"""Parts of the master on their own: names of unknowns, summed inputs, communication points, tangents, iteration."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from linear_systems import integrator
from tca_cosim.cosim.acceleration import Secants, create, norm, solve
from tca_cosim.cosim.acceleration.history import IterationHistory
from tca_cosim.cosim.communication_points import Segment, segments
from tca_cosim.cosim.converted_inputs import convert_inputs
from tca_cosim.cosim.interface import InterfaceVector, TornOutputs
from tca_cosim.cosim.linear_subsystem import Linear
from tca_cosim.cosim.signals import Constant
from tca_cosim.cosim.subsystem import Port
from tca_cosim.cosim.topology import Connection
from tca_cosim.studies.stability.model_problems import couple, dahlquist, linear, wires


def torn(name: str, ports: str, columns: list[int]) -> TornOutputs:
    outputs = tuple(map(Port, ports.split()))
    node: Any = SimpleNamespace(subsystem=SimpleNamespace(name=name, outputs=outputs))
    return TornOutputs(node, np.array(columns), np.ones(len(columns)))


def test_unknowns_have_the_names_of_their_outputs() -> None:
    interface = InterfaceVector([torn("rod", "N delta", [1]), torn("heat", "T P q", [2, 0])], [True, False])
    assert interface.size == 4
    assert [interface.name(k) for k in range(4)] == ["rod.delta", "rod.delta, rate", "heat.q", "heat.T"]
    for outside in (-1, 4):
        with pytest.raises(IndexError):
            interface.name(outside)


# -- inputs that are sums


def test_terms_of_a_sum_and_inputs_beside_it() -> None:
    """u = 2 a + 3 b + 10, v = 4 c + 1, w as it is; the limits of v are those of c, a and b have none."""
    ports = (
        Port("u", nominal=6.0, start=40.0, least=0.0, most=50.0),
        Port("v", nominal=8.0, start=9.0, least=-7.0, most=13.0),
        Port("w", start=3.0, least=-1.0, most=1.0),
    )
    inner = linear("inner", [], [], [], [1, 1, 1], [], "u v w", "y")
    inner.inputs = ports
    connections = [
        Connection(("a", "y"), ("inner", "u"), 2.0, 10.0, term=0, terms=2),
        Connection(("b", "y"), ("inner", "u"), 3.0, 0.0, term=1, terms=2),
        Connection(("c", "y"), ("inner", "v"), 4.0, 1.0),
    ]
    seen = convert_inputs(inner, connections)
    names = [port.name for port in seen.inputs]
    assert names == [connections[0].port, connections[1].port, "v", "w"]
    assert [port.nominal for port in seen.inputs] == [3.0, 2.0, 2.0, 1.0]
    assert [port.start for port in seen.inputs] == [6.0, 6.0, 2.0, 3.0]  # 2 a + 3 b + 10 = 40 where a = b
    assert [(port.least, port.most) for port in seen.inputs[2:]] == [(-2.0, 3.0), (-1.0, 1.0)]
    assert all(math.isinf(port.least) and math.isinf(port.most) for port in seen.inputs[:2])
    assert seen.initialise(0.0, np.array([1.0, 2.0, 3.0, 4.0])) == pytest.approx([2 + 6 + 10 + 12 + 1 + 4])
    np.testing.assert_array_equal(seen.tangent(np.array([0, 1, 2, 3])), [[2.0, 3.0, 4.0, 1.0]])
    np.testing.assert_array_equal(seen.tangent(np.array([1])), [[3.0]])


def test_limits_swap_where_a_factor_is_negative() -> None:
    inner = integrator()
    inner.inputs = (Port("u", nominal=4.0, start=6.0, least=-2.0, most=10.0),)
    [port] = convert_inputs(inner, [Connection(("a", "y"), ("integrator", "u"), -2.0, 2.0)]).inputs
    assert (port.nominal, port.start, port.least, port.most) == (2.0, -2.0, -4.0, 2.0)


def test_the_tangent_by_a_source_has_its_factor() -> None:
    system = linear("system", [-1], [1, 2], [3], [5, 6], [0], "u v", "y")
    seen = convert_inputs(system, [Connection(("a", "y"), ("system", "v"), 4.0, 7.0)])
    np.testing.assert_array_equal(seen.tangent(np.array([0, 1])), [[5.0, 24.0]])


def test_time_in_subsystems_is_counted() -> None:
    master, _ = couple(*dahlquist(), stop=0.5, step=0.1)
    assert all(node.seconds > 0.0 for node in master.nodes)
    assert sum(node.seconds for node in master.nodes) < master.seconds


def test_the_tangent_of_a_linear_system_is_its_feedthrough() -> None:
    system = linear("system", [-1], [1, 2], [3, 4], [5, 6, 7, 8], [0], "u v", "x y")
    assert isinstance(system, Linear)
    np.testing.assert_array_equal(system.tangent(np.array([1])), [[6.0], [8.0]])
    np.testing.assert_array_equal(system.tangent(np.array([0, 1])), [[5.0, 6.0], [7.0, 8.0]])


@pytest.mark.parametrize(("discrete", "reached"), [(True, 0.55), (False, 0.5)])
def test_discrete_inputs_hold_what_their_source_has_at_the_end_of_a_step(discrete: bool, reached: float) -> None:
    """The source goes up by 1 in 1 s: held over steps of 0.1 s its integral is 0.1 (0.1 + 0.2 + ... + 1.0)."""
    source = linear("source", [0], [1], [1], [0], [0], "u", "y")
    target = integrator()
    target.inputs = (replace(target.inputs[0], discrete=discrete),)
    couple([source, target], wires("source.y -> integrator.u"), 1.0, 0.1, signals={"source": {"u": Constant(1.0)}})
    assert target.values()[0] == pytest.approx(reached)


# -- communication points


def test_events_closer_than_any_step_are_points_where_steps_have_no_length() -> None:
    assert list(segments(0.0, 2e-9, None, [5e-10, 1e-9])) == [
        Segment(5e-10, 5e-10, True),
        Segment(5e-10, 1e-9, True),
        Segment(1e-9, 2e-9, False),
    ]


def test_an_event_near_a_point_of_the_grid_takes_its_time() -> None:
    assert [s.end for s in segments(0.0, 1.0, 0.25, [0.5 + 1e-10])] == [0.25, 0.5, 0.75, 1.0]
    assert [s.event for s in segments(0.0, 1.0, 0.25, [0.5 + 1e-10])] == [False, True, False, False]
    assert [s.end for s in segments(0.0, 1.0, 0.25, [0.5 + 1e-9])] == [0.25, 0.5, 0.5 + 1e-9, 0.75 + 1e-9, 1.0]


# -- iteration


def test_an_explicit_first_step_of_cubics_is_iterated_and_no_other() -> None:
    """After the start there is one sample: its tangent is an order less accurate than cubics."""
    _, log = couple(*dahlquist(), stop=0.5, step=0.1, method=None, waveform="hermite")
    assert log[0].sweeps > 1
    assert [entry.sweeps for entry in log[1:]] == [1, 1, 1, 1]
    _, log = couple(*dahlquist(), stop=0.3, step=0.1, method=None, waveform="linear")
    assert [entry.sweeps for entry in log] == [1, 1, 1]


def test_the_same_note_is_made_once() -> None:
    master, _ = couple(*dahlquist(), stop=0.2, step=0.1)
    before = list(master.notes)
    for text in ("one", "two", "one"):
        master._note(text)
    assert master.notes == [*before, "one", "two"]


@pytest.mark.parametrize("method", ["plain", "relaxed", "aitken", "iqn", "broyden", "newton"])
def test_the_error_of_a_linear_loop_is_estimated(method: str) -> None:
    """x = 1 - g x: after the first secant the estimated error is the true one, not the residual."""
    g = 0.5
    history = IterationHistory(1)
    outcome = solve(
        lambda x: 1.0 - g * x, np.zeros(1), np.ones(1), create(method), history, tolerance=1e-6, max_sweeps=60
    )
    assert outcome.converged
    assert abs(outcome.x[0] - 1.0 / (1.0 + g)) <= 1.01 * 1e-6
    assert outcome.error <= 1e-6
    assert outcome.residuals[0] == 1.0


def test_an_iteration_ends_with_its_last_sweep_or_its_first_infinite_value() -> None:
    outcome = solve(
        lambda x: 1.0 - 3.0 * x, np.zeros(1), np.ones(1), create("plain"), IterationHistory(1), 1e-9, max_sweeps=4
    )
    assert (outcome.converged, len(outcome.residuals)) == (False, 4)
    np.testing.assert_allclose(outcome.residuals, [1.0, 3.0, 9.0, 27.0])
    outcome = solve(lambda x: x * np.inf, np.ones(1), np.ones(1), create("plain"), IterationHistory(1), 1e-9, 9)
    assert (outcome.converged, outcome.error, len(outcome.residuals)) == (False, math.inf, 1)


def test_secants_of_no_loop_have_no_radius() -> None:
    assert norm(np.array([3.0, 4.0])) == 5.0
    secants = Secants(1)
    secants.add(np.array([1.0]), np.array([-1.5]))
    error, rest = secants.split(np.array([3.0]))  # r = -1.5 (x - x*), so the error of x is r/1.5
    assert error + rest == pytest.approx([2.0])
