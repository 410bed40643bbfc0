"""The master behind events and difficult stretches: guesses, secants, derivatives, statistics."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from linear_systems import Wrapped, integrator
from tca_cosim import CouplingError
from tca_cosim.cosim.extrapolation import METHODS, Sample
from tca_cosim.cosim.interface import InterfaceVector, TornOutputs
from tca_cosim.cosim.linear_subsystem import Linear
from tca_cosim.cosim.node import DrivenInput, MacroStep, Node
from tca_cosim.cosim.signals import Sine, Steps
from tca_cosim.cosim.statistics import summarize
from tca_cosim.cosim.step_control import Doubling
from tca_cosim.cosim.subsystem import Port
from tca_cosim.studies.stability.model_problems import connected, couple, dahlquist, linear, wires


class Difficult(Wrapped):
    """Takes short steps only where the time is between two bounds [s]."""

    def __init__(self, inner: Linear, longest: float, begin: float, end: float) -> None:
        super().__init__(inner)
        self.limit, self.stretch = longest, (begin, end)

    def step(self, time: float, length: float) -> None:
        self.longest = self.limit if self.stretch[0] < time < self.stretch[1] else math.inf
        super().step(time, length)


def test_after_a_difficult_stretch_steps_are_as_long_as_before_it() -> None:
    plant, law = dahlquist()[0]
    _, log = couple([Difficult(plant, 0.03, 0.15, 0.35), law], dahlquist()[1], 1.0, 0.1)
    lengths = {round(entry.time, 9): entry.step for entry in log}
    assert max(step for time, step in lengths.items() if 0.21 < time < 0.39) <= 0.03
    assert [step for time, step in lengths.items() if time > 0.41] == pytest.approx([0.1] * 6)
    assert all(round(0.1 * k, 9) in lengths for k in range(1, 11))  # back on the communication points


def test_after_an_event_what_was_before_counts_no_more() -> None:
    """Through a block that follows its input at once, an integrator sees a jump as a jump, not as a ramp."""
    signal = Steps((0.0, 0.25), (1.0, -3.0))
    law, sink = linear("law", [], [], [], [2], [], "s", "y"), integrator()
    couple(
        [law, sink],
        wires("law.y -> integrator.u"),
        0.5,
        0.125,
        signals={"law": {"s": signal}},
        breaks=signal.breaks,
    )
    assert sink.values()[0] == pytest.approx(2.0 * (0.25 - 0.75), abs=1e-14)


def test_secants_of_a_step_that_failed_are_discarded() -> None:
    """The first step learns the gain in three sweeps, later ones take two; after a failure it is learned again."""
    plant = linear("plant", [], [], [], [1, 1], [], "u ramp", "x")
    law = Difficult(linear("law", [], [], [], [-3.2], [], "x", "u"), 0.06, 0.25, 0.35)
    connections = wires("plant.x -> law.x", "law.u -> plant.u")
    signals = {"plant": {"ramp": Sine(0.0, 1.0, 0.7)}}
    _, log = couple([plant, law], connections, 0.5, 0.1, signals=signals)
    assert [entry.sweeps for entry in log] == [3, 2, 2, 3, 2, 2]


def test_the_trust_radius_is_in_nominals() -> None:
    """A loop of 1e4 N with that nominal moves less than its trust radius of 3; with a nominal of 1 it moves further."""
    for nominal, fails in ((1e4, False), (1.0, True)):
        plant, law = dahlquist()[0]
        plant.start = 1e4 * plant.start
        plant.outputs, law.outputs = (Port("x", nominal=nominal),), (Port("u", nominal=nominal),)
        if fails:
            with pytest.raises(CouplingError, match="reach of 3 nominals"):
                couple([plant, law], dahlquist()[1], 0.2, 0.1, reach=3.0)
        else:
            couple([plant, law], dahlquist()[1], 0.2, 0.1, reach=3.0)


def test_an_event_leaves_no_derivatives_of_inputs_that_are_not_known() -> None:
    source = linear("source", [-1], [], [1], [], [1], "", "y")
    source.has_rates = False
    sink = integrator()
    master = connected([source, sink], wires("source.y -> integrator.u"), "iqn", through="quadratic")
    for k in range(3):
        master.advance(MacroStep(0.1 * k, 0.1, 0.1 * (k + 1)))
    node = next(node for node in master.nodes if node.subsystem is sink)
    assert np.abs(node.inputs[1:]).max() > 0.1
    master.arrive(0.3)
    assert np.abs(node.inputs[1:]).max() == 0.0


@pytest.mark.parametrize(
    ("waveform", "order", "tolerance"), [("held", 1, 1e-2), ("linear", 2, 1e-4), ("quadratic", 3, 1e-6)]
)
def test_doubling_estimates_the_error_of_the_two_halves(waveform: str, order: int, tolerance: float) -> None:
    """The length that it proposes shows its estimate, which the exact solution confirms."""
    step = 0.02
    systems, connections = dahlquist()
    master = connected(systems, connections, "iqn", waveform, tolerance=1e-13)
    control = Doubling(step, tolerance, least=0.0, most=1.0)
    time = 0.0
    for _ in range(2):  # so that there are samples for the waveform's degree
        master.advance(MacroStep(time, step, time + step))
        time += step
    before = systems[0].values()[0]
    result = control.attempt(master, MacroStep(time, step, time + step))
    estimate = (0.9 * step / result.next_length) ** (order + 1.0)
    values = master.outputs()
    exact = before * math.exp(-5.0 * step)
    errors = (values - np.array([exact, -4.0 * exact])) / (tolerance * (1.0 + np.abs(values)))
    assert estimate == pytest.approx(float(np.sqrt(np.mean(errors**2))), rel=0.4)


def test_the_first_guess_continues_values_and_slopes() -> None:
    """A parabola through three samples: value and length times slope at the end of the step are exact."""
    system = linear("a", [0], [], [1], [], [0], "", "y")
    node = Node(system, (), (), np.zeros((4, 0)))
    parabola = np.polynomial.Polynomial([0.3, -1.1, 0.7])
    node.samples = tuple(Sample(t, np.array([parabola(t)]), np.array([parabola.deriv()(t)])) for t in (0.0, 0.2, 0.3))
    interface = InterfaceVector([TornOutputs(node, np.array([0]), np.array([1.0]))], [True])
    x = interface.predict(METHODS["quadratic"].fit, 0.3, 0.25)
    assert x == pytest.approx([parabola(0.55), 0.25 * parabola.deriv()(0.55)])
    guess = interface.unpack(x, lambda node: node.samples[-1], 0.55, 0.25)[node]
    assert guess.rates == pytest.approx([parabola.deriv()(0.55)])
    assert interface.pack(lambda _: guess, 0.25) == pytest.approx(x)


def test_undeclared_nominals_follow_the_values_in_steps_of_ten() -> None:
    """A value and its rate have one nominal. One that is zero yet has that of the largest in its unit; what is small
    beside the others in its unit is noise."""
    system = linear("a", [0], [], [[1], [1]], [[], []], [0], "", "y z")
    system.outputs = tuple(Port(name, "N", has_nominal=False) for name in "yz")
    node = Node(system, (), (), np.zeros((4, 0)))
    interface = InterfaceVector([TornOutputs(node, np.array([0, 1]), np.ones(2))], [True])
    assert not interface.adapt(np.zeros(4))
    assert interface.adapt(np.array([2.0, 1e-9, 6.0, 0.0]))
    assert interface.scale == pytest.approx([6.0, 6.0, 6.0, 6.0])
    assert not interface.adapt(np.array([50.0, 0.0, 0.0, 0.0]))
    assert interface.adapt(np.array([70.0, 0.0, 0.0, 0.0]))
    assert interface.scale == pytest.approx([70.0, 70.0, 70.0, 70.0])
    assert interface.adapt(np.array([0.0, 1e-3, 0.0, 0.0]))
    assert interface.scale == pytest.approx([70.0, 0.07, 70.0, 0.07])
    assert interface.adapt_provisionally(np.array([0.0, 4.0, 0.0, 0.0]))
    assert interface.adapt(np.array([0.0, 0.1, 0.0, 0.0]))  # the solution is smaller than the first sweep
    assert interface.scale == pytest.approx([70.0, 0.1, 70.0, 0.1])


def test_statistics_count_what_was_done() -> None:
    systems = [Wrapped(system, longest=0.06) for system in dahlquist()[0]]
    master, log = couple(systems, dahlquist()[1], 0.5, 0.1)
    actual = summarize(master, log)
    assert actual["steps"] == len(log) == 10
    assert actual["rejected_steps"] == 5
    assert actual["rollbacks"] == sum(system.restores for system in systems)
    assert actual["sweeps_per_step"] == pytest.approx(sum(entry.sweeps for entry in log) / 10)
    assert actual["most_sweeps"] == max(entry.sweeps for entry in log)
    assert (actual["smallest_step_s"], actual["largest_step_s"]) == pytest.approx((0.05, 0.05))
    seconds = actual["seconds"]
    assert set(seconds["subsystems"]) == {"plant", "law"}
    parts = [*seconds["subsystems"].values(), seconds["recording"], seconds["master"]]
    assert sum(parts) == pytest.approx(master.seconds, abs=1e-5)
    assert min(parts) >= 0.0


def test_discrete_inputs_hold_the_value_of_their_signal() -> None:
    system = linear("a", [0], [1, 1], [1], [0, 0], [0], "u v", "y")
    system.inputs = (replace(system.inputs[0], discrete=True), system.inputs[1])
    sine = Sine(0.5, 2.0, 1.7, 0.3)
    node = Node(system, (), tuple(DrivenInput(k, sine) for k in (0, 1)), np.full((4, 2), 7.0))
    node.apply_signals(0.4, 0.1)
    assert node.inputs[:, 0] == pytest.approx([sine.polynomial(0.4, 0.1)[0], 0.0, 0.0, 0.0], abs=0.0)
    assert node.inputs[:, 1] == pytest.approx(sine.polynomial(0.4, 0.1), abs=0.0)


def test_rates_are_guessed_where_they_are_unknowns_alone() -> None:
    system = linear("a", [0], [], [1], [], [0], "", "y")
    node = Node(system, (), (), np.zeros((4, 0)))
    sample = Sample(0.0, np.array([3.0]), np.array([5.0]))
    interface = InterfaceVector([TornOutputs(node, np.array([0]), np.array([1.0]))], [False])
    guess = interface.unpack(np.array([4.0]), lambda _: sample, 0.1, 0.1)[node]
    assert (guess.values.tolist(), guess.rates) == ([4.0], None)
    assert interface.pack(lambda _: sample, 0.1).tolist() == [3.0]


def test_a_provisional_nominal_of_the_right_size_is_kept() -> None:
    system = linear("a", [0], [], [1], [], [0], "", "y")
    system.outputs = (Port("y", "N", has_nominal=False),)
    interface = InterfaceVector(
        [TornOutputs(Node(system, (), (), np.zeros((4, 0))), np.array([0]), np.ones(1))], [False]
    )
    assert interface.adapt_provisionally(np.array([40.0]))
    assert not interface.adapt(np.array([30.0]))
    assert interface.scale == pytest.approx([40.0])
