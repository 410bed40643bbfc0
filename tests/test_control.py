"""Observers, controllers against disturbed plants, and the environment."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
import tca_cosim as tca
from tca_cosim.control import HeatObserver, LinearController, PredictiveController
from tca_cosim.linear import balanced_truncation
from tca_cosim.linear.linearisation import linearise_now
from tca_cosim.planning import PlanLimits
from tca_cosim.planning.heat import HeatModel
from tca_cosim.planning.rod import StaticRod

DISPLACEMENTS = ("delta[1]", "delta[2]", "delta[3]")


def test_displacements_are_seen_in_the_resistances_alone(at_most) -> None:
    """Scene sine, resistances with a noise of 0.1 %, which alone is 0.4 mm; the model's powers are 20 % wrong."""
    scene = tca.read("sine", {"thermal.tca.beta": 0.1, "rod.closure": "inside"})
    random, noise, errors = np.random.default_rng(0), 6.9e-3, []
    with HeatModel(scene) as heat, StaticRod(scene, DISPLACEMENTS) as rod, tca.Simulation(scene) as plant:
        observer = HeatObserver(heat, rod, 0.1)
        observer.error[:] = 0.2
        for k in range(1, 301):
            before = plant["thermal.V"]
            plant.step(0.1 * k)
            V = plant["thermal.V"]
            observer.predict(0.5 * (before + V))
            R = np.full(3, np.nan)
            flows = V > 0.2  # else there is no current to measure
            R[flows] = V[flows] ** 2 / plant["thermal.P"][flows] + noise * random.standard_normal(flows.sum())
            observer.measure_resistances(R, noise)
            errors.append(observer.displacements - plant["rod.delta"])
    at_most("displacements from resistances [m rms]", np.sqrt(np.mean(np.square(errors))), 0.2e-3)


def circle(times: np.ndarray) -> np.ndarray:
    """Tip (x, y) [m] at times [s]: out to a radius of 8 mm within 15 s, then round in 60 s."""
    angle, radius = 2.0 * np.pi * (times - 20.0) / 60.0, 8e-3 * np.clip(times / 15.0, 0.0, 1.0)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def controlled(wrong: dict[str, object], limits: PlanLimits, updates: int) -> tuple[float, float, float]:
    """Root mean square error of a wrong plant's tip from 20 s on [m]; its highest mean and hottest temperature [K]."""
    model = tca.read("step", {"rod.closure": "inside", "rod.order": 0})
    settings = {"rod.closure": "inside", "rod.order": 0, "stop_time": 110.0, "thermal.V": 0.0}
    random, errors, mean, hottest = np.random.default_rng(0), [], 0.0, 0.0
    with (
        HeatModel(model) as heat,
        StaticRod(model, ("tip.p[1]", "tip.p[2]", *DISPLACEMENTS)) as rod,
        tca.Simulation("step", settings | wrong) as plant,
    ):
        controller = PredictiveController(heat, rod, circle, limits)
        for k in range(updates):
            tip = plant["rod.tip.p"][:2] + 1e-4 * random.standard_normal(2)
            controller.measure(tip, plant["thermal.T"] + 0.2 * random.standard_normal(3), 0.2)
            voltages = controller.update(0.1 * k)
            assert 0.0 <= voltages.min() <= voltages.max() <= limits.voltage
            plant.step(0.1 * (k + 1), {"thermal.V": voltages})
            mean, hottest = max(mean, plant["thermal.T"].max()), max(hottest, plant["thermal.T_max"])
            if k >= 200:
                errors.append(plant["rod.tip.p"][:2] - circle(np.array(plant.time)))
    return float(np.sqrt(np.mean(np.sum(np.square(errors), axis=1)))), mean, hottest


@pytest.mark.slow
@pytest.mark.parametrize(
    "wrong",
    [
        {"thermal.tca.R": [8.28, 5.52, 8.28], "thermal.h": 16.0, "rod.body.E": 45.36e3},
        {"thermal.tca.R": 5.52, "thermal.h": 24.0, "rod.body.E": 45.36e3},
    ],
)
def test_predictive_control_follows_a_circle_with_a_wrong_plant(wrong: dict[str, object], at_most) -> None:
    """Two of twelve combinations of errors of 20 %; all, 1000 updates each, by hand: 0.05 to 0.11 mm."""
    rms, _, hottest = controlled(wrong, PlanLimits(5.0, 373.15, 373.15), 400)
    at_most("tip beside the circle [m rms]", rms, 0.5e-3)
    at_most("hottest point [K]", hottest, 374.15)


@pytest.mark.slow
def test_a_body_of_two_sections_is_controlled(at_most) -> None:
    """Six TCAs in two cross-sections; one section's resistances are 13 % lower than the model's."""
    model = tca.read("serial", {"rod.closure": "inside", "rod.order": 0})
    settings = {"rod.closure": "inside", "lower.V": 0.0, "upper.V": 0.0, "lower.tca.R": 6.0}
    outputs = ("tip.p[1]", "tip.p[2]", *(f"delta[{k}]" for k in range(1, 7)))
    random, errors = np.random.default_rng(0), []
    with HeatModel(model) as heat, StaticRod(model, outputs) as rod, tca.Simulation("serial", settings) as plant:
        controller = PredictiveController(heat, rod, lambda t: 0.5 * circle(t), PlanLimits(5.0, 373.15, 373.15))
        for k in range(200):
            T = np.concatenate([plant["lower.T"], plant["upper.T"]]) + 0.2 * random.standard_normal(6)
            controller.measure(plant["rod.tip.p"][:2], T, 0.2)
            voltages = controller.update(0.1 * k)
            plant.step(min(0.1 * (k + 1), 20.0), {"lower.V": voltages[:3], "upper.V": voltages[3:]})
            if k >= 120:
                errors.append(plant["rod.tip.p"][:2] - 0.5 * circle(np.array(plant.time)))
    at_most("tip beside the path [m rms]", np.sqrt(np.mean(np.sum(np.square(errors), axis=1))), 0.3e-3)


@pytest.mark.slow
@pytest.mark.parametrize("limits", [PlanLimits(5.0, 368.15, 323.15), PlanLimits(5.0, 323.15, 368.15)])
def test_predictive_control_keeps_limits_that_act(limits: PlanLimits) -> None:
    """One case limits the mean temperatures, one the hottest points; either limit makes the circle smaller."""
    wrong = {"thermal.tca.R": 5.52, "thermal.h": 16.0, "rod.body.E": 45.36e3}
    rms, mean, hottest = controlled(wrong, limits, 350)
    assert mean < limits.temperature + 1.0
    assert hottest < limits.hottest + 1.0
    assert max(mean - limits.temperature, hottest - limits.hottest) > -1.5, "neither acts"
    assert 0.2e-3 < rms < 4e-3


def test_a_linear_controller_moves_the_tip_and_holds_it() -> None:
    settings = {"rod.closure": "inside", "thermal.V": [1.0, 1.2, 1.0], "stop_time": 4000.0, "coupling.macro_step": 10.0}
    with tca.Simulation("step", settings) as plant:
        plant.step(3000.0)
        model = linearise_now(plant).select(["thermal.V"], ["rod.tip.p[1]", "rod.tip.p[2]"])
        reduced = balanced_truncation(model, 6)
        controller = LinearController(reduced, 0.5, {"rod.tip.p": 1e-3}, {"thermal.V": 0.3})
        assert np.abs(controller.poles()).max() < 1.0
        wanted = np.array([0.5e-3, -0.5e-3])
        controller.set_target(wanted)
        for k in range(1, 121):
            plant.step(3000.0 + 0.5 * k, {"thermal.V": controller.update(plant["rod.tip.p"][:2], 0.0, 5.0)})
        np.testing.assert_allclose(plant["rod.tip.p"][:2] - model.y_0, wanted, atol=0.1e-3)
        for wrong in ([NAN, 0.0], [0.0], "warm"):
            with pytest.raises(tca.SceneError, match=r"give 2 numbers|give finite numbers"):
                controller.update(wrong, 0.0, 5.0)
            with pytest.raises(tca.SceneError, match=r"give 2 numbers|give finite numbers"):
                controller.set_target(wrong)
        assert np.isfinite(controller.update(plant["rod.tip.p"][:2], 0.0, 5.0)).all()
    with pytest.raises(tca.SceneError, match=r"no weight for rod\.tip\.p"):
        LinearController(reduced, 0.5, {"rod.delta": 1.0}, {"thermal.V": 0.3})
    with pytest.raises(tca.SceneError, match="step = 0: give a positive number"):
        LinearController(reduced, 0.0, {"rod.tip.p": 1e-3}, {"thermal.V": 0.3})


@pytest.fixture(scope="module")
def controller_parts() -> Iterator[tuple[HeatModel, StaticRod]]:
    model = tca.read("step", {"rod.closure": "inside", "rod.order": 0})
    with HeatModel(model) as heat, StaticRod(model, ("tip.p[1]", "tip.p[2]", *DISPLACEMENTS)) as rod:
        yield heat, rod


NAN, COLD, CENTRE = float("nan"), np.full(3, 298.15), np.zeros(2)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"step": 0.0}, "step = 0: give a positive number"),
        ({"knots": 0}, "knots = 0: give a positive number"),
        ({"scale": NAN}, "scale = nan: give a positive number"),
        ({"horizon": 1.0}, "shorter than 20 knots of 0.1 s; give fewer knots"),
    ],
)
def test_controllers_refuse_what_they_cannot_be(
    controller_parts: tuple[HeatModel, StaticRod], options: dict[str, float], message: str
) -> None:
    with pytest.raises(tca.SceneError, match=message):
        PredictiveController(*controller_parts, circle, PlanLimits(), **options)


@pytest.mark.parametrize(
    ("measured", "path", "message"),
    [
        ((np.zeros(3), COLD, 0.2), circle, r"outputs: shape \(3,\); give 2 numbers"),
        ((CENTRE, COLD[:2], 0.2), circle, r"temperatures: shape \(2,\); give 3 numbers"),
        ((CENTRE, COLD, 0.0), circle, "deviation = 0: give a positive number"),
        ((CENTRE, COLD + np.inf, 0.2), circle, "or nan where one is missing"),
        ((CENTRE, COLD, 0.2), lambda times: circle(times) * NAN, "path: .*not finite; give finite numbers of shape"),
        ((CENTRE, COLD, 0.2), lambda times: circle(times)[0], r"give finite numbers of shape \(20, 2\)"),
    ],
)
def test_no_number_that_is_none_becomes_a_voltage(
    controller_parts: tuple[HeatModel, StaticRod],
    measured: tuple[np.ndarray, np.ndarray, float],
    path: Callable[[np.ndarray], np.ndarray],
    message: str,
) -> None:
    controller = PredictiveController(*controller_parts, path, PlanLimits())

    def update() -> None:
        controller.measure(*measured)
        controller.update(0.0)

    with pytest.raises(tca.SceneError, match=message):
        update()


def test_sensors_may_drop_out(controller_parts: tuple[HeatModel, StaticRod]) -> None:
    """With no measurement at all the plan of the model alone is followed; with one of two outputs that one counts."""
    blind, half = (PredictiveController(*controller_parts, circle, PlanLimits()) for _ in range(2))
    blind.measure(CENTRE * NAN, COLD * NAN, 0.2)
    half.measure(np.array([1e-3, NAN]), np.array([298.15, NAN, 298.15]), 0.2)
    alone, shifted = blind.update(0.0), half.update(0.0)
    assert np.isfinite([alone, shifted]).all()
    fresh = PredictiveController(*controller_parts, circle, PlanLimits()).update(0.0)
    np.testing.assert_allclose(alone, fresh, rtol=1e-6)
    assert np.abs(shifted - alone).max() > 0.01
    with pytest.raises(tca.SceneError, match=r"voltages = .*give finite numbers"):
        half.observer.predict(np.array([1.0, NAN, 1.0]))


def test_a_plant_that_is_hot_already_is_seen_and_cooled(controller_parts: tuple[HeatModel, StaticRod]) -> None:
    """The controller is switched on when the mean temperatures are 96 degC, above its limit of 90 degC."""
    settings = {"rod.closure": "inside", "rod.order": 0, "stop_time": 120.0, "thermal.V": [3.0, 3.0, 3.0]}
    limits, random = PlanLimits(5.0, 363.15, 363.15), np.random.default_rng(0)
    controller = PredictiveController(*controller_parts, lambda t: np.tile([-20e-3, 0.0], (len(t), 1)), limits)
    with tca.Simulation("step", settings) as plant:
        plant.step(29.0)
        before = plant["thermal.T_max"]
        for k in range(40):
            T = plant["thermal.T"] + 0.2 * random.standard_normal(3)
            controller.measure(plant["rod.tip.p"][:2] + 1e-4 * random.standard_normal(2), T, 0.2)
            assert np.abs(controller.observer.temperatures - plant["thermal.T"]).max() < 1.5
            plant.step(29.1 + 0.1 * k, {"thermal.V": controller.update(0.1 * k)})
            assert plant["thermal.T_max"] < before
        assert plant["thermal.T_max"] < limits.hottest + 1.0


def test_observers_need_the_displacements() -> None:
    model = tca.read("step", {"rod.closure": "inside"})
    message = r"end them with delta\[1\], delta\[2\], delta\[3\]"
    with (
        HeatModel(model) as heat,
        StaticRod(model, ("tip.p[1]", "tip.p[2]")) as rod,
        pytest.raises(tca.SceneError, match=message),
    ):
        HeatObserver(heat, rod, 0.1)
    with pytest.raises(tca.SceneError, match=r"'tip\.q\[1\]': the rod has no such output; did you mean"):
        StaticRod(model, ("tip.q[1]",))


def test_the_environment_passes_the_checker() -> None:
    gymnasium = pytest.importorskip("gymnasium")
    import tca_cosim.control.environment as environment
    from gymnasium.utils.env_checker import check_env

    environment.register()
    env = gymnasium.make("tca/Reach-v0")
    check_env(env.unwrapped, skip_render_check=True)
    first, _ = env.reset(seed=3)
    rewards = [env.step(np.array([0.5, -1.0, -1.0], dtype=np.float32))[1] for _ in range(10)]
    again, _ = env.reset(seed=3)
    assert (first == again).all()
    assert rewards == [env.step(np.array([0.5, -1.0, -1.0], dtype=np.float32))[1] for _ in range(10)]
    env.close()
    several = gymnasium.make_vec("tca/Reach-v0", 2, vectorization_mode="sync")
    observations, _ = several.reset(seed=1)
    assert observations.shape == (2, 7)
    *_, info = several.step(several.action_space.sample())
    assert info["distance"].shape == (2,)
    several.close()


@pytest.fixture(scope="module")
def reach() -> Iterator[Any]:
    pytest.importorskip("gymnasium")
    from tca_cosim.control.environment import ReachEnv

    env = ReachEnv()
    yield env
    env.close()


@pytest.mark.parametrize(
    "action", [[0.0], 0.0, np.zeros(6), np.zeros((3, 1)), [0.0, NAN, 0.0], [0.0, np.inf, 0.0], "a"]
)
def test_a_refused_action_takes_no_step(reach: Any, action: object) -> None:
    """The next action lasts one step, not two."""
    reach.reset(seed=1)
    reach.step(np.zeros(3))
    expected = reach.step(np.zeros(3))[0]
    reach.reset(seed=1)
    reach.step(np.zeros(3))
    with pytest.raises(tca.SceneError, match=r"action.*give (3|finite) numbers"):
        reach.step(action)
    assert (reach.step(np.zeros(3))[0] == expected).all()


def test_episodes_end_and_options_are_checked(reach: Any) -> None:
    from tca_cosim.control.environment import STEPS

    reach.reset(seed=1)
    ends = [reach.step(np.full(3, -1.0))[3] for _ in range(STEPS)]
    assert ends == [False] * (STEPS - 1) + [True]
    with pytest.raises(tca.SceneError, match=r"the episode has ended after 150 steps; call reset\(\)"):
        reach.step(np.zeros(3))
    for options, message in (
        ({"targt": (0.0, 0.0)}, "'targt': unknown; allowed: 'target'"),
        ({"target": (5.0, 0.0)}, "give coordinates of up to 0.2 m"),
        ({"target": (NAN, 0.0)}, "give finite numbers"),
        ({"target": (0.0, 0.0, 0.0)}, "give 2 numbers"),
    ):
        with pytest.raises(tca.SceneError, match=message):
            reach.reset(options=options)
    observation, _ = reach.reset(options={"target": (2e-3, -4e-3)})
    np.testing.assert_allclose(observation[-2:], [0.1, -0.2], rtol=1e-6)


def test_environments_of_other_manipulators() -> None:
    """Several sections have actions one after the other; limits that the start exceeds are refused."""
    pytest.importorskip("gymnasium")
    from tca_cosim.control.environment import ReachEnv

    env = ReachEnv("serial")
    try:
        env.reset(seed=1)
        cold = env.step(np.full(6, -1.0))[0]
        warm = env.step(np.array([-1.0, -1.0, -1.0, 1.0, -1.0, -1.0]))[0]
        assert np.argmax(warm[:6] - cold[:6]) == 3
    finally:
        env.close()
    for options, message in (
        ({"temperature": 298.15}, "starts at 298.15 K; give a higher"),
        ({"scene": "gripper"}, "made for a scene with one manipulator"),
        ({"scene": "fan"}, "plan with convection = constant"),
    ):
        with pytest.raises(tca.SceneError, match=message):
            ReachEnv(**options)
