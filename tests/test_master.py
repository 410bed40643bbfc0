"""The master's order of work, events, rollback, control of steps."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import pytest
from linear_systems import Wrapped, driven, integrator
from tca_cosim import CouplingError
from tca_cosim.cosim.signals import Impulse, Ramps, Sine, Steps
from tca_cosim.cosim.step_control import Doubling, Embedded
from tca_cosim.cosim.topology import components
from tca_cosim.studies.stability.model_problems import couple, dahlquist, linear, wires


def test_what_feeds_a_loop_is_stepped_once_per_macro_step() -> None:
    source = linear("source", [-1], [], [1], [], [1], "", "T")
    loop = linear("loop", [-1], [0, 1], [1], [0, 0], [0], "T guess", "y")
    law = linear("law", [], [], [], [-4, 1], [], "y T", "u")
    connections = wires("source.T -> law.T", "loop.y -> law.y", "law.u -> loop.guess")
    _, log = couple([law, loop, source], connections, 1.0, 0.1)
    assert source.steps == len(log) == 10
    assert loop.steps == sum(entry.sweeps for entry in log) > 10


def test_order_of_work() -> None:
    connections = wires("b.y -> c.u", "c.y -> b.u", "c.y -> a.u", "d.y -> b.v", "a.y -> a.w")
    actual = components(["a", "b", "c", "d"], connections)
    assert [component.members for component in actual] == [("d",), ("b", "c"), ("a",)]
    assert [[str(c) for c in component.torn] for component in actual] == [[], ["c.y -> b.u"], ["a.y -> a.w"]]
    assert len(components(["b", "c", "d", "a"], connections, jacobi=True)[1].torn) == 2


@pytest.mark.parametrize(
    ("signal", "exact", "short"),  # short: lengths of steps that lead to an event or the stop time
    [
        (Steps((0.0, 0.33, 0.77), (2.0, -1.0, 4.0)), 2.0 * 0.33 - 0.44 + 4.0 * 0.23, [0.03, 0.04, 0.03]),
        (Ramps((0.2, 0.45, 0.7), (1.0, 3.0, -1.0)), 0.2 + 0.5 + 0.25 - 0.3, [0.05, 0.05]),
    ],
    ids=["steps", "ramps"],
)
def test_events_are_hit_exactly(signal: object, exact: float, short: list[float]) -> None:
    system = integrator()
    _, log = couple([system], [], 1.0, 0.1, signals=driven(signal), breaks=signal.breaks)
    assert system.values()[0] == pytest.approx(exact, abs=1e-14)
    assert set(signal.breaks) - {0.0} <= {entry.time for entry in log}
    assert [entry.step for entry in log if abs(entry.step - 0.1) > 1e-12] == pytest.approx(short)


@pytest.mark.parametrize(
    ("signal", "exact"),
    [
        (Sine(0.5, 2.0, 1.7, 0.3), 0.5 + 1.7 / math.pi * (math.cos(0.3) - math.cos(2.0 * math.pi / 1.7 + 0.3))),
        (Impulse(peak=3.0, width=0.4, start=0.25), 2.0 * 3.0 * 0.4 / math.pi),
    ],
    ids=["sine", "impulse"],
)
def test_smooth_signals_are_integrated_exactly(signal: object, exact: float) -> None:
    for step in (0.3, 0.1):
        system = integrator()
        couple([system], [], 1.0, step, signals=driven(signal), breaks=signal.breaks)
        assert system.values()[0] == pytest.approx(exact, abs=1e-14)


def test_state_is_saved_once_per_macro_step_and_handles_are_reused() -> None:
    plant, law = (Wrapped(system) for system in dahlquist()[0])
    _, log = couple([plant, law], dahlquist()[1], 1.0, 0.1)
    assert plant.saves == 10
    assert plant.restores == plant.tries - 10 == sum(entry.sweeps - 1 for entry in log)
    assert len(plant.handles) == 1


def test_doubling_releases_its_handles_and_keeps_to_its_tolerance() -> None:
    errors = []
    for tolerance in (1e-4, 1e-6):
        systems = [Wrapped(system) for system in dahlquist()[0]]
        control = Doubling(0.1, tolerance, least=1e-5, most=1.0)
        _, log = couple(systems, dahlquist()[1], 2.0, control=control, tolerance=1e-10)
        errors.append(abs(systems[0].values()[0] - math.exp(-10.0)))
        assert len(systems[0].handles) == 1
        assert log[-1].time == 2.0
        assert max(entry.step for entry in log) > 2.0 * min(entry.step for entry in log)
    assert errors[1] < 0.1 * errors[0] < 1e-3


@pytest.mark.parametrize(
    ("waveform", "coarse"), [("held", 1e-1), ("linear", 1e-3), ("quadratic", 1e-4), ("hermite", 1e-4)]
)
def test_embedded_control_follows_its_tolerance(waveform: str, coarse: float) -> None:
    errors, counts = [], []
    for tolerance in (coarse, 0.1 * coarse):
        systems = [Wrapped(system) for system in dahlquist()[0]]
        control = Embedded(0.01, tolerance, least=1e-6, most=1.0)
        _, log = couple(systems, dahlquist()[1], 2.0, control=control, waveform=waveform, tolerance=1e-10)
        errors.append(abs(systems[0].values()[0] - math.exp(-10.0)))
        counts.append(len(log))
        assert len(systems[0].handles) == 1
        assert log[-1].time == 2.0
        assert max(entry.step for entry in log) > 2.0 * min(entry.step for entry in log[1:-1])
    assert errors[1] < 0.3 * errors[0] < 1e-2
    assert counts[0] < counts[1] < 2000


@pytest.mark.parametrize("partial", [False, True], ids=["refusing", "discarding"])
def test_a_step_too_long_for_a_subsystem_is_tried_shorter(partial: bool) -> None:
    systems = [Wrapped(system, longest=0.03, partial=partial) for system in dahlquist()[0]]
    reference, _ = dahlquist()
    _, log = couple(systems, dahlquist()[1], 0.5, 0.1, waveform="hermite", tolerance=1e-10)
    couple(reference, dahlquist()[1], 0.5, 0.025, waveform="hermite", tolerance=1e-10)
    assert log[-1].time == 0.5
    assert max(entry.step for entry in log) <= 0.03
    assert systems[0].values()[0] == pytest.approx(
        math.exp(-2.5), abs=3.0 * abs(reference[0].values()[0] - math.exp(-2.5)) + 1e-9
    )


def test_a_step_that_all_but_succeeds_is_not_tried_again_without_end() -> None:
    """What a subsystem reached is then the same step again, but for rounding."""
    systems = [Wrapped(system, longest=0.1 * (1.0 - 1e-14), partial=True) for system in dahlquist()[0]]
    _, log = couple(systems, dahlquist()[1], 0.5, 0.1, waveform="hermite", tolerance=1e-10)
    assert log[-1].time == 0.5
    assert systems[0].tries < 20 * len(log)


def test_a_subsystem_that_always_refuses_ends_the_run_with_its_words() -> None:
    systems = [Wrapped(system) for system in dahlquist()[0]]
    systems[0].longest = 0.0
    with pytest.raises(CouplingError, match="plant: longer than 0") as caught:
        couple(systems, dahlquist()[1], 1.0, 0.1, halvings=4)
    assert systems[0].tries == 5
    assert caught.value.step == pytest.approx(0.1 / 16.0)
    assert systems[0].state == pytest.approx([1.0], abs=0.0)
    assert "nan" not in str(caught.value)  # nothing was iterated, so nothing is said of residuals and gain


def test_a_hopeless_iteration_names_time_residuals_gain_and_remedy() -> None:
    plant = linear("plant", [], [], [], [1, 1], [], "u ramp", "x")
    law = linear("law", [], [], [], [-3.2], [], "x", "u")
    connections = wires("plant.x -> law.x", "law.u -> plant.u")
    signals = {"plant": {"ramp": Ramps((0.0, 10.0), (0.0, 1.0))}}
    with pytest.raises(CouplingError) as caught:
        couple([plant, law], connections, 1.0, 0.1, method="plain", signals=signals)
    error = caught.value
    assert error.time == 0.0
    assert error.gain == pytest.approx(3.2, rel=1e-6)
    assert error.residuals[-1] > 1e3 * error.residuals[0] > 0.0
    assert "3.2" in str(error)
    assert "iqn" in error.remedy


@dataclass(frozen=True)
class Recorder(Embedded):
    """Keeps its step length, and records each estimate with the order that is expected of it."""

    records: list[tuple[float, float]] = field(default_factory=list)

    def next_length(self, length: float, error: float, order: float, growth: float) -> float:
        self.records.append((error, order))
        return length


@pytest.mark.parametrize("waveform", ["held", "linear", "quadratic", "hermite"])
def test_embedded_control_expects_the_order_of_its_estimate(waveform: str) -> None:
    """Halving the step divides the estimate at one time by 2 to the power that the next length is computed with."""
    errors, orders = [], set()
    for step in (0.02, 0.01):
        oscillator = linear("oscillator", [[0, 1], [-1, 0]], [], [1, 0], [], [1, 0.3], "", "y")
        sink = linear("sink", [0], [1], [], [], [0], "u", "")
        control = Recorder(step, 1.0, least=step, most=step)
        couple([oscillator, sink], wires("oscillator.y -> sink.u"), 1.0, control=control, waveform=waveform)
        error, order = control.records[-1]
        errors.append(error)
        orders.add(order)
    assert orders == {round(math.log2(errors[0] / errors[1]))}


def test_without_a_loop_there_is_one_sweep_and_nothing_to_iterate() -> None:
    chain = [linear("source", [-1], [], [1], [], [1], "", "T"), integrator()]
    _, log = couple(chain, wires("source.T -> integrator.u"), 0.5, 0.1)
    assert {(entry.sweeps, entry.residual, entry.error, entry.inverse) for entry in log} == {(1, 0.0, 0.0, None)}
