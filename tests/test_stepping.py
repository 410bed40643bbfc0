"""The stepping interface: same values as a run, inputs from outside, saved states, refusals with a remedy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import tca_cosim as tca
from tca_cosim.cosim.signals import Ramps


def test_steps_from_outside_are_those_of_a_run() -> None:
    result = tca.run("step", {"stop_time": 2.0})
    with tca.Simulation("step", {"stop_time": 2.0}) as sim:
        for until in (0.5, 1.0, 1.25, 2.0):
            sim.step(until)
        assert sim.time == 2.0
        np.testing.assert_allclose(sim["rod.tip.p"], result["rod.tip.p"][-1], atol=1e-9)
        np.testing.assert_allclose(sim["thermal.T"], result["thermal.T"][-1], rtol=1e-9)
        assert sim["thermal.T[3]"] == sim["thermal.T"][2]
        assert set(sim.values(["rod.delta", "thermal.T_max"])) == {"rod.delta", "thermal.T_max"}
        assert sim.values()["rod.shape.p"].shape == (63,)


def test_inputs_from_outside_act_as_those_of_the_scene() -> None:
    held = {"thermal.V": [1.0, 0.0, 2.0], "rod.gravity[1]": 3.0}
    result = tca.run("step", {"stop_time": 1.0, "thermal.V": [1.0, 0.0, 2.0], "rod.gravity": [3.0, 0.0, 0.0]})
    with tca.Simulation("step", {"stop_time": 1.0}) as sim:
        sim.step(1.0, held)
        np.testing.assert_allclose(sim["rod.tip.p"], result["rod.tip.p"][-1], atol=1e-8)
    ramp = Ramps((0.0, 1.0), (0.0, 2.0))
    result = tca.run("step", {"stop_time": 1.0, "thermal.V[1]": ramp})
    with tca.Simulation("step", {"stop_time": 1.0}) as sim:
        sim.step(0.5, {"thermal.V[1]": ramp})
        sim.step(1.0)
        np.testing.assert_allclose(sim["thermal.T"], result["thermal.T"][-1], rtol=1e-10)


@pytest.mark.parametrize("closure", ["inside", "exchanged"])
def test_a_restored_state_goes_on_to_the_last_bit(closure: str) -> None:
    with tca.Simulation("step", {"rod.closure": closure, "rod.dynamic": True, "rod.order": 1}) as sim:
        sim.step(0.5)
        state = sim.save()
        outcomes = []
        for _ in range(3):
            sim.step(1.0, {"thermal.V[1]": 4.0})
            outcomes.append(sim["rod.tip.p"])
            sim.restore(state)
        assert sim.time == 0.5
        assert (outcomes[0] == outcomes[1]).all()
        assert (outcomes[1] == outcomes[2]).all()
        sim.release(state)
        with pytest.raises(tca.SubsystemError, match="released"):
            sim.restore(state)
        sim.restart()
        assert sim.time == 0.0
        np.testing.assert_allclose(sim["thermal.T"], 298.15)


def test_many_calls_leave_no_trace() -> None:
    with tca.Simulation("step") as sim:
        for k in range(1, 41):
            sim.step(0.07 * k)
        assert sim._ready.master.notes == []


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"thermal.T": 300.0}, r"thermal\.T cannot be set; inputs that nothing feeds are thermal\.V\[1\]"),
        ({"rod.T": 300.0}, r"rod\.T cannot be set"),
        ({"thermal.V": [1.0, 2.0]}, r"2 values for 3 elements"),
        ({"thermal.V": float("nan")}, r"finite number"),
        ({"thermal.V": "hot"}, r"finite number"),
        ({"heat.V": 1.0}, r"no FMU 'heat'; the scene has thermal, rod"),
        ({"thermal.U": 1.0}, r"no variable 'U'"),
    ],
)
def test_refusals_change_nothing(inputs: dict[str, object], message: str) -> None:
    with tca.Simulation("step") as sim:
        with pytest.raises(tca.SceneError, match=message):
            sim.step(0.1, inputs)
        assert sim.time == 0.0
        for until in (0.0, 1e-12, float("nan"), 31.0, "soon", None, [1.0, 2.0]):
            with pytest.raises(tca.SceneError, match=r"later time|later stop_time"):
                sim.step(until)


def test_what_an_fmu_refuses_changes_nothing() -> None:
    """Neither of the inputs is kept: the next step is one with the inputs before."""
    with tca.Simulation("step") as sim:
        sim.step(0.5)
        state, volts = sim.save(), sim["thermal.V"]
        sim.step(0.6)
        expected = sim["thermal.T"]
        for refused in ({"thermal.T_ambient": -5.0}, {"thermal.V": 1e200}):
            sim.restore(state)
            with pytest.raises(tca.SubsystemError, match=r"allowed: 1 K to 10000 K|reduce the voltage"):
                sim.step(0.6, {"rod.tip_force": 1e-3} | refused)
            assert sim.time == 0.5
            assert (sim["thermal.V"] == volts).all()
            sim.step(0.6)
            assert (sim["thermal.T"] == expected).all()


def test_states_of_another_simulation_are_refused() -> None:
    with tca.Simulation("step") as sim, tca.Simulation("step") as same, tca.Simulation("antagonist") as other:
        sim.step(0.5, {"thermal.V[1]": 1.0})
        own, before = sim.save(), sim.values()
        for state in (same.save(), other.save(), None):
            for use in (sim.restore, sim.release):
                with pytest.raises(tca.SceneError, match=r"not a state of this simulation; give one that its save\(\)"):
                    use(state)  # type: ignore[arg-type]
        assert sim.time == 0.5
        assert all(np.array_equal(value, before[name]) for name, value in sim.values().items())
        sim.restore(own)


@pytest.mark.parametrize(
    ("use", "message"),
    [
        (lambda sim: sim.set_inputs({"thermal.V": [[1.0], [2.0, 3.0]]}), "finite number, as many as it has elements"),
        (
            lambda sim: sim.set_inputs({"thermal.V": 1.0, "thermal.V[1]": 2.0}),
            r"thermal\.V\[1\] is set twice; keep one",
        ),
        (lambda sim: sim.set_inputs([1.0, 2.0, 3.0]), "list; give a mapping such as"),
        (lambda sim: sim.set_inputs({3: 1.0}), "3: int; name variables 'member.variable'"),
        (lambda sim: sim[None], "NoneType; name variables 'member.variable'"),
        (lambda sim: sim.instance("heat"), "no FMU 'heat'; the scene has thermal, rod"),
        (lambda sim: sim.values("rod.tip"), "no variable 'tip'"),
    ],
)
def test_names_and_values_of_another_kind_are_refused(use: Callable[[tca.Simulation], object], message: str) -> None:
    with tca.Simulation("step") as sim:
        before = sim["thermal.V"]
        with pytest.raises(tca.SceneError, match=message):
            use(sim)
        assert (sim["thermal.V"] == before).all()


def test_a_closed_simulation_says_so() -> None:
    """Its FMUs may serve another simulation by then."""
    sim = tca.Simulation("step", {"stop_time": 1.0})
    sim.step(0.5)
    assert np.isfinite(sim["rod.tip.p"]).all()
    sim.close()
    sim.close()
    for use in (lambda: sim.step(1.0), lambda: sim["rod.tip.p"], sim.save, sim.restart):
        with pytest.raises(tca.SceneError, match="the simulation is closed; open it again"):
            use()
