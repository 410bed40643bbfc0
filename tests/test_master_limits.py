"""The master where subsystems lack capabilities, nominals, or fail."""

from __future__ import annotations

import math

import numpy as np
import pytest
from linear_systems import Wrapped
from tca_cosim import CouplingError, SubsystemError
from tca_cosim.cosim.signals import Steps
from tca_cosim.cosim.subsystem import Port
from tca_cosim.studies.stability.model_problems import couple, dahlquist, linear, wires


@pytest.mark.parametrize("method", [None, "plain"])
def test_no_subsystem_is_asked_for_what_is_out_of_reach(method: str | None) -> None:
    """A growing loop ends while its values are still moderate, and halving goes no further than asked."""
    systems, connections = dahlquist()
    tried = []
    systems[0] = Wrapped(systems[0])
    inner = systems[0].inner
    systems[0].set_inputs = lambda polynomials: (
        tried.append(np.abs(polynomials[0]).max()),
        inner.set_inputs(polynomials),
    )
    with pytest.raises(CouplingError, match="reach of 3 nominals") as caught:
        couple(systems, connections, 40.0, 0.8, method, "held", reach=3.0, halvings=0)
    assert max(tried) < 30.0
    assert caught.value.step == 0.8


def test_without_rollback_only_explicit_coupling_runs() -> None:
    systems, connections = dahlquist()
    systems[0].can_rollback = False
    with pytest.raises(SubsystemError, match="method = 'none'"):
        couple(systems, connections, 1.0, 0.1)
    couple(systems, connections, 1.0, 0.1, method=None)


def test_what_a_subsystem_cannot_do_falls_back_to_what_it_can_and_is_said_once() -> None:
    """Without rates of the law the waveform is of an order less; inputs that cannot be interpolated are held."""
    ends = {}
    for offers, takes in ((True, True), (False, True), (True, False)):
        systems, connections = dahlquist()
        systems[1].has_rates, systems[0].takes_polynomials = offers, takes
        master, _ = couple(systems, connections, 1.0, 0.05, waveform="hermite", tolerance=1e-11)
        ends[offers, takes] = (abs(systems[0].values()[0] - math.exp(-5.0)), master.notes)
    assert ends[True, True][1] == []
    assert ends[False, True][1] == ["law offers no output derivatives", "inputs of plant are described as quadratic"]
    assert ends[True, False][1] == ["plant takes no input derivatives", "inputs of plant are described as held"]
    assert 3.0 * ends[True, True][0] < ends[False, True][0] < 0.1 * ends[True, False][0] < 1e-2


@pytest.mark.parametrize("size", [1e-7, 1e-3, 1.0, 1e5, 1e9])
def test_values_without_nominals_couple_by_default(size: float) -> None:
    """A gain of 4 with a force of any size against a displacement of another: as exact as with nominals."""
    plant = linear("plant", [-1], [1.0 / size], [1], [0], [1], "u", "x")
    law = linear("law", [], [], [], [-4.0 * size], [], "x", "u")
    plant.outputs, law.outputs = (Port("x", has_nominal=False),), (Port("u", "N", has_nominal=False),)
    connections = wires("plant.x -> law.x", "law.u -> plant.u")
    _, log = couple([plant, law], connections, 0.5, 0.05, waveform="hermite", reach=10.0)
    assert plant.values()[0] == pytest.approx(math.exp(-2.5), abs=1e-5)
    assert max(entry.sweeps for entry in log) <= 5
    reference, _ = dahlquist()
    couple(reference, connections, 0.5, 0.05, waveform="hermite", reach=10.0)
    assert plant.values()[0] == pytest.approx(reference[0].values()[0], abs=1e-6)


def test_explicit_coupling_follows_values_without_nominals_as_they_grow() -> None:
    """x' = 3 x to 1.6e5: each step is off by 1e-3 of the value, in the end by far more than 10 of the first nominal."""
    (plant, law), connections = dahlquist(-4.0)
    plant.outputs, law.outputs = (Port("x", has_nominal=False),), (Port("u", has_nominal=False),)
    couple([plant, law], connections, 4.0, 0.02, method=None)
    assert plant.values()[0] == pytest.approx(math.exp(12.0), rel=0.05)


def test_without_nominals_a_loop_that_starts_at_zero_jumps_to_its_size() -> None:
    """Nothing acts for 0.2 s, then 1e5 N at once: neither the zero before nor the jump stop the iteration."""
    plant = linear("plant", [-1], [[1e-5, 1e-5]], [1], [0, 0], [0], "u load", "x")
    law = linear("law", [], [], [], [-4e5], [], "x", "u")
    plant.outputs, law.outputs = (Port("x", has_nominal=False),), (Port("u", has_nominal=False),)
    signal = Steps((0.0, 0.2), (0.0, 1e5))
    couple(
        [plant, law],
        wires("plant.x -> law.x", "law.u -> plant.u"),
        1.2,
        0.05,
        waveform="hermite",
        signals={"plant": {"load": signal}},
        breaks=signal.breaks,
        reach=10.0,
    )
    assert plant.values()[0] == pytest.approx(0.2 * (1.0 - math.exp(-5.0)), abs=1e-5)


def test_a_guess_limit_that_stops_a_step_says_so_by_name() -> None:
    plant, law = dahlquist()[0]
    plant.start = 1e5 * plant.start
    with pytest.raises(CouplingError) as caught:
        couple([plant, law], dahlquist()[1], 40.0, 0.8, "plain", "held", reach=3.0, halvings=0)
    assert "coupling.reach" in str(caught.value)
    assert "law.u" in caught.value.cause
    assert "nominal 1" in caught.value.cause


def test_feedthrough_is_consistent_at_the_start_and_behind_events() -> None:
    """x = s(t) - 3 x / 2 - 3 x / 2, gain 3, where s jumps: the waveform's slopes and values settle without a step."""
    a = linear("a", [], [], [], [1, 1], [], "u s", "x")
    b = linear("b", [], [], [], [-3], [], "x", "u")
    signal = Steps((0.0, 0.5), (1.0, -2.0))
    master, _ = couple(
        [a, b],
        wires("a.x -> b.x", "b.u -> a.u"),
        1.0,
        0.25,
        waveform="hermite",
        signals={"a": {"s": signal}},
        breaks=signal.breaks,
    )
    np.testing.assert_allclose(master.outputs(), [-0.5, 1.5], atol=1e-6)
