"""The master's own duties: order of work, events, rollback, retries, failures."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tca_cosim import CouplingError, SubsystemError
from tca_cosim.cosim.extrapolation import METHODS, Sample
from tca_cosim.cosim.interface import InterfaceVector, TornOutputs
from tca_cosim.cosim.linear_subsystem import Linear
from tca_cosim.cosim.node import MacroStep, Node
from tca_cosim.cosim.signals import Impulse, Ramps, Sine, Steps
from tca_cosim.cosim.statistics import summarize
from tca_cosim.cosim.step_control import Doubling, Embedded
from tca_cosim.cosim.subsystem import Port
from tca_cosim.cosim.topology import components
from tca_cosim.studies.stability.model_problems import connected, couple, dahlquist, linear, wires


class Wrapped:
    """A linear system that keeps a diary and can be made to refuse."""

    def __init__(self, inner: Linear, longest: float = math.inf, partial: bool = False) -> None:
        self.inner, self.longest, self.partial = inner, longest, partial
        self.saves = self.restores = self.tries = 0
        self.handles: set[int] = set()

    def __getattr__(self, name: str) -> object:
        return getattr(self.inner, name)

    def step(self, time: float, length: float) -> None:
        self.tries += 1
        if length > self.longest:
            reached = None
            if self.partial:
                self.inner.step(time, self.longest)
                reached = time + self.longest
            raise SubsystemError(f"{self.inner.name}: longer than {self.longest}", reached)
        self.inner.step(time, length)

    def save(self, into: object = None) -> object:
        self.saves += 1
        state = self.inner.save()
        if into is None:
            into = [None]
            self.handles.add(id(into))
        into[0] = state
        return into

    def restore(self, state: list) -> None:
        self.restores += 1
        self.inner.restore(state[0])

    def free(self, state: list) -> None:
        self.handles.remove(id(state))


def driven(signal: object) -> dict:
    return {"integrator": {"u": signal}}


def integrator() -> Linear:
    return linear("integrator", [0], [1], [1], [0], [0], "u", "y")


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
    found = components(["a", "b", "c", "d"], connections)
    assert [component.members for component in found] == [("d",), ("b", "c"), ("a",)]
    assert [[str(c) for c in component.torn] for component in found] == [[], ["c.y -> b.u"], ["a.y -> a.w"]]
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
    """A value and its rate have one nominal; what is small beside the others in its unit is noise."""
    system = linear("a", [0], [], [[1], [1]], [[], []], [0], "", "y z")
    system.outputs = tuple(Port(name, "N", has_nominal=False) for name in "yz")
    node = Node(system, (), (), np.zeros((4, 0)))
    interface = InterfaceVector([TornOutputs(node, np.array([0, 1]), np.ones(2))], [True])
    assert not interface.adapt(np.zeros(4))
    assert interface.adapt(np.array([2.0, 1e-9, 6.0, 0.0]))
    assert interface.scale == pytest.approx([6.0, 6e-3, 6.0, 6e-3])
    assert not interface.adapt(np.array([50.0, 0.0, 0.0, 0.0]))
    assert interface.adapt(np.array([70.0, 0.0, 0.0, 0.0]))
    assert interface.scale == pytest.approx([70.0, 0.07, 70.0, 0.07])
    assert interface.adapt_provisionally(np.array([0.0, 4.0, 0.0, 0.0]))
    assert interface.adapt(np.array([0.0, 0.1, 0.0, 0.0]))  # the solution is smaller than the first sweep
    assert interface.scale == pytest.approx([70.0, 0.1, 70.0, 0.1])


def test_statistics_count_what_was_done() -> None:
    systems = [Wrapped(system, longest=0.06) for system in dahlquist()[0]]
    master, log = couple(systems, dahlquist()[1], 0.5, 0.1)
    found = summarize(master, log)
    assert found["steps"] == len(log) == 10
    assert found["rejected_steps"] == 5
    assert found["rollbacks"] == sum(system.restores for system in systems)
    assert found["sweeps_per_step"] == pytest.approx(sum(entry.sweeps for entry in log) / 10)
    assert found["most_sweeps"] == max(entry.sweeps for entry in log)
    assert (found["smallest_step_s"], found["largest_step_s"]) == pytest.approx((0.05, 0.05))
    seconds = found["seconds"]
    assert set(seconds["subsystems"]) == {"plant", "law"}
    parts = [*seconds["subsystems"].values(), seconds["recording"], seconds["master"]]
    assert sum(parts) == pytest.approx(master.seconds, abs=1e-5)
    assert min(parts) >= 0.0
