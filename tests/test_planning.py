"""Plans: the bar of the slow circle, exact gradients, limits, files; against a formulation of its own."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
import tca_cosim.cli
from tca_cosim.planning import PathProblem, PlanLimits, Target, plan, read_target, target_of, workspace
from tca_cosim.planning.heat import HeatModel
from tca_cosim.planning.rod import StaticRod
from tca_cosim.scene import Scene
from typer.testing import CliRunner

pytest.importorskip("piqp")
DISPLACEMENTS = ("delta[1]", "delta[2]", "delta[3]")


def circle(start: float, period: float, radius: float) -> Callable[[Scene], Target]:
    def target(scene: Scene) -> Target:
        times = np.linspace(start, start + period, 121)
        angle = 2.0 * np.pi * (times - start) / period
        return target_of(scene, times, {"rod.tip.p[1]": radius * np.cos(angle), "tip.p[2]": radius * np.sin(angle)})

    return target


@pytest.mark.parametrize(
    "overrides",
    [
        {},
        {"rod.dynamic": True, "rod.closure": "inside", "rod.order": 2, "rod.gravity": [0.0, 0.0, -9.81]},
        {"thermal.tca.alpha_T": 1e-3, "thermal.tca.beta": 0.1},
    ],
)
@pytest.mark.slow
def test_the_slow_circle_is_followed_by_the_full_models(overrides: dict[str, object], at_most) -> None:
    made = plan("step", circle(20.0, 60.0, 8e-3), PlanLimits(5.0, 373.15, 373.15), 1.0, overrides)
    assert made.converged
    at_most("error of the path [m rms]", made.rms, 0.1e-3)
    assert 0.0 <= made.voltages.min() <= made.voltages.max() <= 5.0
    at_most("hottest point [K]", float(made.result["thermal.T_max"].max()), 373.15 + 0.01)
    assert made.active == ()
    assert made.result.attrs["status"] == "complete"


def test_the_gradient_by_all_voltages_is_exact(at_most) -> None:
    scene = tca.read("step", {"rod.gravity": [2.0, 0.0, -9.0], "rod.order": 2})
    with HeatModel(scene) as heat, StaticRod(scene, ("tip.p[1]", "tip.p[2]", *DISPLACEMENTS)) as rod:
        times = 0.5 * np.arange(1, 31)
        path = circle(2.0, 13.0, 8e-3)(scene).at(times)
        problem = PathProblem(heat, rod, PlanLimits(), 0.5, path, (times >= 2.0).astype(float), 8e-3)
        random = np.random.default_rng(3)
        voltages = random.uniform(0.3, 2.5, problem.shape)
        before = rod.equilibria
        _, gradient = problem.gradient(voltages)
        assert rod.equilibria - before == len(times), "one pass over the path, whatever the number of voltages"

        def cost(V: np.ndarray) -> float:
            powers = V**2 / heat.electrics.R
            return problem.cost(powers, rod.outputs(problem.temperatures(powers), times)[:, :2])

        for _ in range(3):
            d, h = random.standard_normal(voltages.shape), 1e-3
            near = cost(voltages + h * d) - cost(voltages - h * d)
            far = cost(voltages + 2.0 * h * d) - cost(voltages - 2.0 * h * d)
            exact = (gradient * d).sum()
            at_most("gradient, relative error", abs((8.0 * near - far) / (12.0 * h) / exact - 1.0), 1e-6)


@pytest.mark.slow
def test_an_infeasible_path_is_approximated_as_well_as_by_collocation(at_most) -> None:
    """The same problem in all modes and strains at once, by Radau collocation and IPOPT with exact Hessians."""
    ca = pytest.importorskip("casadi")
    limits = PlanLimits(voltage=4.0, temperature=333.15, hottest=1000.0)
    made = plan("step", circle(2.0, 4.0, 12e-3), limits, 0.25)
    assert any("V[1] at 4 V" in text for text in made.active)
    assert any("at 60 degC" in text for text in made.active)
    assert made.rms > 1e-4
    scene = tca.read("step")
    with HeatModel(scene) as heat, StaticRod(scene, ("tip.p[1]", "tip.p[2]", *DISPLACEMENTS)) as rod:
        times = made.times[1:]
        weights = (times >= 2.0 - 1e-9).astype(float)
        problem = PathProblem(heat, rod, limits, 0.25, made.target.at(times), weights, made.target.scales)
        ours = problem.solve()
        T = np.array([320.0, 300.0, 310.0])
        np.testing.assert_allclose(np.array(arc(ca, ca.DM(T))).ravel(), rod.outputs(T[None])[0, :2], rtol=1e-4)
        tau, n = ca.collocation_points(3, "radau"), len(heat.A)
        C, D, _ = ca.collocation_coeff(tau)
        largest = limits.voltage**2 / heat.electrics.R
        opti = ca.Opti()
        p = opti.variable(3, len(times))
        opti.subject_to(opti.bounded(0.0, ca.vec(p), 1.0))
        x, objective = ca.DM.zeros(n), 0.0
        for k in range(len(times)):
            z = opti.variable(n, 3)
            rate = ca.mtimes(ca.DM(heat.A), z) + ca.repmat(
                ca.mtimes(ca.DM(heat.B), p[:, k] * largest) + heat.offset, 1, 3
            )
            opti.subject_to(ca.mtimes(ca.horzcat(x, z), C) == 0.25 * rate)
            x = ca.mtimes(ca.horzcat(x, z), D)
            T = heat.T_start + ca.mtimes(ca.DM(heat.C), x)
            opti.subject_to(limits.temperature >= T)
            if weights[k]:
                objective += 0.5 * ca.sumsqr((arc(ca, T) - problem.path[k]) / problem.scale)
            if k:
                objective += 0.5e-6 * ca.sumsqr(p[:, k] - p[:, k - 1])
        opti.set_initial(p, 0.1)
        opti.minimize(objective)
        options = {"print_level": 0, "sb": "yes", "tol": 1e-6, "max_iter": 100}
        opti.solver("ipopt", {"print_time": False, "expand": True}, options)
        theirs = float(opti.solve().value(objective))
    at_most("cost beside collocation, relative difference", abs(ours.cost / theirs - 1.0), 1e-2)


def arc(ca, T):  # type: ignore[no-untyped-def]
    """Tip (x, y) [m] of the unloaded manipulator of set fig3: an arc whose bending and stretch are in closed form."""
    L, r, EI, EA, k, stroke = 0.04, 2.5e-3, 1.855503e-5, 2.968805, 79.5378, 7.95322e-3 / (1.0 - 1.0 / 1.026)
    c = stroke * (1.0 - 1.0 / (1.0 + 6.5e-4 * (T - 298.15)))
    a = 2.0 * np.pi * np.arange(3) / 3.0
    stretch = k * ca.sum1(c) / (EA + 3.0 * k * L)
    x, y = (k * r * ca.sum1(c * f(a)) / (EI + 1.5 * k * L * r**2) for f in (np.cos, np.sin))
    angle = L * ca.sqrt(x**2 + y**2 + 1e-12)
    length = L * (1.0 + stretch)
    return -length * (1.0 - ca.cos(angle)) / angle**2 * L * ca.vertcat(x, y)


@pytest.mark.parametrize("rate", [0.1, 0.5])
@pytest.mark.slow
def test_rates_of_voltages_are_kept(rate: float) -> None:
    made = plan("step", circle(10.0, 20.0, 5e-3), PlanLimits(voltage_rate=rate), 0.5)
    changes = np.diff(np.vstack([np.zeros(3), made.voltages]), axis=0)
    assert np.abs(changes).max() <= rate * 0.5 * (1.0 + 1e-9)


def test_way_points_are_joined_and_units_converted(tmp_path: Path) -> None:
    file = tmp_path / "reach.csv"
    file.write_text("time [s],rod.tip.p[1] [mm],tip.euler[2] [deg]\n5,-5,0\n12,-10,-10\n20,-10,-10\n", encoding="utf-8")
    target = read_target(tca.read("step"), file)
    assert target.outputs == ("tip.p[1]", "tip.euler[2]")
    np.testing.assert_allclose(target.at(np.array([0.0, 5.0, 12.0, 30.0]))[:, 0], [-5e-3, -5e-3, -10e-3, -10e-3])
    np.testing.assert_allclose(target.values[1, 1], np.deg2rad(-10.0))
    middle = target.at(np.linspace(5.0, 20.0, 50))[:, 0]
    assert (np.diff(middle) <= 1e-15).all()
    file.write_text("time,rod.tip.q[1]\n5,0\n6,1\n", encoding="utf-8")
    with pytest.raises(tca.SceneError, match="no such output"):
        read_target(tca.read("step"), file)
    file.write_text("time,rod.tip.p[1]\n5,0\n", encoding="utf-8")
    with pytest.raises(tca.SceneError, match="two times at least"):
        read_target(tca.read("step"), file)


def test_the_command_writes_a_scene_that_repeats_the_plan(tmp_path: Path) -> None:
    rows = [f"{t},{-8e-3 * math.sin(0.2 * (t - 5))}" for t in np.linspace(5.0, 15.0, 21)]
    (tmp_path / "wave.csv").write_text("time,tip.p[1]\n" + "\n".join(rows), encoding="utf-8")
    arguments = ["plan", str(tmp_path / "wave.csv"), "--out", str(tmp_path), "--set", "rod.gravity=[1,0,0]"]
    result = CliRunner().invoke(tca.cli.app, arguments)
    assert result.exit_code == 0, result.output
    assert "mm rms" in result.output
    planned = tca.read(tmp_path / "wave.toml")
    assert planned.member("rod").signals["gravity[1]"].value == 1.0
    again = tca.run(planned)
    printed = float(result.output.split("full models:")[1].split("mm rms")[0])
    inside = again["time"].to_numpy() >= 5.0
    error = again["rod.tip.p"].to_numpy()[inside, 0] + 8e-3 * np.sin(0.2 * (again["time"].to_numpy()[inside] - 5.0))
    assert 1e3 * np.sqrt(np.mean(error**2)) == pytest.approx(printed, rel=0.3, abs=1e-3)


def test_the_workspace_holds_equilibria_within_the_limits(tmp_path: Path) -> None:
    limits = PlanLimits(5.0, 343.15, 343.15)
    area = workspace("step", limits, 4)
    assert (area.temperatures <= 343.15 + 1e-9).all()
    assert np.hypot(*area.tips[:, :2].T).max() > 10e-3
    hottest = np.argmax(area.temperatures[:, 0])
    volts = np.sqrt(area.powers[hottest] * 6.9)
    settled = {"thermal.V": volts, "stop_time": 2000.0, "coupling.macro_step": 100.0}
    with tca.Simulation("step", settled) as sim:
        sim.step(2000.0)
        np.testing.assert_allclose(sim["rod.tip.p"], area.tips[hottest], atol=1e-7)
    assert (area.speeds > 0.0).any()
    outcome = CliRunner().invoke(tca.cli.app, ["workspace", "step", "--points", "3", "--out", str(tmp_path)])
    assert outcome.exit_code == 0, outcome.output
    assert (tmp_path / "step.workspace.csv").is_file()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,tip.p[1],rod.tip.p[1]\n1,0,0\n2,0,0\n", r"'tip\.p\[1\]' is given twice; keep one"),
        ("time,tip.p[1],tip.p[1]\n1,0,0\n2,0,0\n", r"two columns 'tip\.p\[1\]'; keep one"),
        ("time,tip.p[1] [degC]\n1,0\n2,0\n", "give a unit that converts to 'm'"),
        ("time,tip.p[1]\n1,0\n2,nan\n", r"path\.csv: row 2: not finite"),
        ("time,tip.p[1]\n1,0\n2\n", r"path\.csv: row 2: 1 cells for 2 names"),
        ("time,tip.p[1]\n1,0\n", r"path\.csv: a path needs two times at least"),
        ("time,tip.p[1]\n1,0\n1,0\n2,0\n", r"path\.csv: path: time 1 s in row 2 after 1 s; give finite times that"),
        ("time,tip.p[1]\n-1,0\n1,0\n", r"path: time -1 s in row 1; give finite times that increase, from 0 s"),
        ("", "no rows"),
    ],
)
def test_wrong_paths_are_refused(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text(text, encoding="utf-8")
    with pytest.raises(tca.SceneError, match=message):
        read_target(tca.read("step"), tmp_path / "path.csv")


def test_what_plans_cannot_take_along_is_refused() -> None:
    path = circle(4.0, 4.0, 2e-3)
    with pytest.raises(tca.SceneError, match=r"2 FMUs with the model 'rod' \(left, right\)"):
        workspace("gripper", points=2)
    elsewhere = {"connections": ["thermal.T_surface -> rod.T[1]", "thermal.T[2] -> rod.T[2]"]}
    with pytest.raises(tca.SceneError, match=r"rod\.T\[1\] comes from thermal\.T_surface"):
        plan("step", path, overrides=elsewhere)
    with pytest.raises(tca.SceneError, match=r"a connection such as 'thermal\.T -> rod\.T'"):
        plan("step", path, overrides={"connections": []})
    with pytest.raises(tca.SceneError, match="plan with convection = constant"):
        plan("fan", path)
    with pytest.raises(tca.SceneError, match="set start_time = 0"):
        plan("step", path, overrides={"start_time": 2.0})
    assert plan("step", path, overrides={"start_time": 0.0}).reached
    with pytest.raises(tca.SceneError, match=r"\(--step\) = 9 s: give a length of up to 8 s"):
        plan("step", path, distance=9.0)
    with pytest.raises(tca.SceneError, match="give 46 or fewer"):
        workspace("step", points=300)
    with pytest.raises(tca.SceneError, match="limit temperature = -26 K: give a positive number"):
        PlanLimits(temperature=-26.0)


SERIAL = {"lower.tca.beta": 0.1, "upper.tca.alpha_T": 1e-3}
WIRES = [f"lower.T[{k}] -> rod.T[{k}]" for k in (1, 2, 3)] + [f"rod.delta[{k}] -> lower.delta[{k}]" for k in (1, 2, 3)]
MIXED = ["0.5*lower.T[1] + 0.5*upper.T[1] -> rod.T[4]", "upper.T[2] -> rod.T[5]", "upper.T[3] -> rod.T[6]"]


def test_a_body_of_two_sections_follows_a_path(tmp_path: Path) -> None:
    """Six TCAs in two cross-sections, one TCA in both, with resistances that change: tip and displacement at once."""

    def both(scene: Scene) -> Target:
        t = np.linspace(6.0, 14.0, 33)
        tip = {f"tip.p[{k}]": 2e-3 * wave(0.4 * (t - 6.0)) for k, wave in ((1, np.sin), (2, np.cos))}
        return target_of(scene, t, tip | {"delta[1]": np.full(t.size, 2e-4)})

    limits = PlanLimits(5.0, 373.15, 343.15)
    made = plan("serial", both, limits, 0.5, {**SERIAL, "connections": WIRES + MIXED})
    assert made.reached
    assert made.rms < 0.1e-3
    for section in ("lower", "upper"):
        assert float(made.result[f"{section}.T_max"].max()) <= 343.16
    files = made.write(tmp_path, "both")
    head = files[0].read_text(encoding="utf-8").splitlines()[0]
    assert head.startswith("time [s],lower.V[1] [V],lower.V[2] [V],lower.V[3] [V],upper.V[1] [V]")
    again = tca.run(files[1])
    np.testing.assert_allclose(again["rod.tip.p"].to_numpy(), made.result["rod.tip.p"].to_numpy(), atol=1e-9)


def test_limits_of_each_section_are_named() -> None:
    far = {"tip.p[1]": [-30e-3, -30e-3]}
    made = plan("serial", lambda scene: target_of(scene, [6.0, 10.0], far), PlanLimits(4.0, 320.0, 330.0))
    assert not made.reached
    assert made.keeps_limits
    assert any(text.startswith("lower.T[1] at 46.85 degC: ") for text in made.active)
    assert any(text.startswith("upper.V[1] at 0 V: ") for text in made.active)


def test_a_path_out_of_reach_and_a_rate_that_acts_are_named(tmp_path: Path) -> None:
    """Millimetres written where metres are meant is the usual reason."""
    (tmp_path / "far.csv").write_text("time,tip.p[1]\n4,-3\n6,-4\n", encoding="utf-8")
    arguments = ["plan", str(tmp_path / "far.csv"), "--out", str(tmp_path)]
    result = CliRunner().invoke(tca.cli.app, arguments)
    assert result.exit_code == 0, result.output
    assert "out of reach within the limits; its values are tip.p[1] in m" in result.output
    (tmp_path / "far.csv").write_text("time,tip.p[1] [mm]\n4,-3\n6,-4\n", encoding="utf-8")
    assert "out of reach" not in CliRunner().invoke(tca.cli.app, arguments).output
    slow = plan("step", circle(4.0, 4.0, 8e-3), PlanLimits(voltage_rate=0.05))
    assert not slow.reached
    assert any("changes by 0.05 V/s" in text for text in slow.active)


def test_limits_that_contradict_each_other_are_named() -> None:
    with pytest.raises(tca.SceneError, match="positive number"):
        PlanLimits(voltage=-1.0)
    with pytest.raises(tca.SceneError, match="raise the limits temperature and hottest"):
        plan("step", circle(5.0, 10.0, 8e-3), PlanLimits(temperature=280.0, hottest=280.0))
    with pytest.raises(
        tca.SceneError, match=r"without power the TCAs get 25 degC, the limit of temperature is 16\.85 degC; raise it"
    ):
        workspace("step", PlanLimits(temperature=290.0))


def test_plans_of_too_many_knots_are_refused_and_the_remedy_is_taken() -> None:
    """A short step over a long path would need more memory than there is."""
    limit = 2000
    for end, step in ((20.0, 1e-3), (20.0, 1e-320), (1e9, 0.5)):
        with pytest.raises(tca.SceneError, match=r"knots of 3 TCAs until .* are too many; give") as refused:
            plan("step", lambda scene, end=end: target_of(scene, [5.0, end], {"tip.p[1]": [0.0, 1e-3]}), distance=step)
        advised = float(str(refused.value).split("give ")[1].split(" s")[0])
        assert 0.95 * limit < 3 * end / advised <= limit


@pytest.mark.slow
def test_errors_of_several_units_are_weighed_and_told_one_by_one(tmp_path: Path) -> None:
    """The tip of one section leans where it goes: both cannot be had, and neither is given up for the other."""
    text = "time,tip.p[1] [mm],tip.euler[2]\n10,-2,0\n16,-2,0\n"
    (tmp_path / "upright.csv").write_text(text, encoding="utf-8")
    made = plan("step", lambda scene: read_target(scene, tmp_path / "upright.csv"))
    np.testing.assert_allclose(made.target.scales, [2e-3, 0.2])
    assert not made.reached
    assert made.errors.keys() == {"m", "rad"}
    assert made.errors["m"][1] < 1e-3
    assert made.errors["rad"][1] < 0.09  # 2 mm to the side are 0.1 rad
    output = (
        CliRunner()
        .invoke(tca.cli.app, ["plan", str(tmp_path / "upright.csv"), "--out", str(tmp_path), "--scene", "serial"])
        .output
    )
    assert " mm rms" in output
    assert " rad rms" in output
    assert "out of reach" not in output


def test_a_tip_is_held_at_the_centre_against_a_force() -> None:
    """A path that is zero everywhere has no size of its own."""
    force = {"rod.tip_force": [2e-3, 0.0, 0.0]}
    centre = {"tip.p[1]": [0.0, 0.0], "tip.p[2]": [0.0, 0.0]}
    assert float(tca.run("step", force | {"thermal.V": 0.0, "stop_time": 1.0})["rod.tip.p"][-1, 0]) > 1e-3
    made = plan("step", lambda scene: target_of(scene, [10.0, 16.0], centre), overrides=force)
    assert made.largest < 1e-5
    assert made.reached


def test_a_far_path_is_approached_up_to_the_limits() -> None:
    """Metres away, the nearest point is still where limits act."""
    made = plan("step", lambda scene: target_of(scene, [10.0, 16.0], {"tip.p[1]": [8.0, 8.0]}))
    assert not made.reached
    assert float(made.result["rod.tip.p"][-1, 0]) > 0.02
    assert any("hottest point at 100 degC" in text for text in made.active)


def test_large_voltages_are_bounded_by_the_temperatures_from_the_first_guess_on() -> None:
    made = plan("step", circle(10.0, 10.0, 4e-3), PlanLimits(voltage=200.0))
    assert made.reached
    assert made.keeps_limits
    with pytest.raises(
        tca.SubsystemError, match=r"rod at rest at .* degC; lower the limits of voltage and temperature"
    ):
        workspace("step", PlanLimits(temperature=1e4, hottest=1e4), 3, {"rod.body.E": "2 kPa"})


def test_paths_of_what_heat_does_not_change_are_refused() -> None:
    with pytest.raises(tca.SceneError, match=r"'tip\.v\[1\]': heat does not change it while the rod is at rest"):
        plan("step", lambda scene: target_of(scene, [5.0, 9.0], {"tip.v[1]": [1e-3, 1e-3]}))


def test_what_stops_a_plan_is_named(tmp_path: Path) -> None:
    """Surroundings that warm up: a limit of temperature is passed; an oscillating load: no limit acts."""
    (tmp_path / "hot.csv").write_text("t,T\n0,298\n10,298\n12,360\n30,360\n", encoding="utf-8")
    (tmp_path / "way.csv").write_text("t,tip.p[1] [mm],tip.p[2] [mm]\n10,8,0\n20,0,8\n30,-8,0\n", encoding="utf-8")
    arguments = ["plan", str(tmp_path / "way.csv"), "--out", str(tmp_path), "--temperature", "60", "--set"]
    hot = CliRunner().invoke(
        tca.cli.app, [*arguments, f"thermal.T_ambient={{table={{file='{tmp_path / 'hot.csv'}',column='T'}}}}"]
    )
    assert "the full models pass a limit of temperature" in hot.output
    assert "their hottest point gets 60." in hot.output
    (tmp_path / "still.csv").write_text("t,tip.p[1] [mm],tip.p[2] [mm]\n10,1,0\n16,1,0\n", encoding="utf-8")
    pushed = "rod.tip_force[1]={sine={amplitude='2 mN',period=0.6}}"
    shaken = CliRunner().invoke(
        tca.cli.app, ["plan", str(tmp_path / "still.csv"), "--out", str(tmp_path), "--set", pushed]
    )
    assert "not followed, though no limit acts" in shaken.output, shaken.output
