"""The outcome of a run: files kept, limits exceeded, new scenes, help."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest
import tca_cosim as tca
import xarray as xr
from command_line import call
from tca_cosim import results


def test_results_of_other_settings_are_kept(here: Path) -> None:
    for override in ((), (), ("--set", "thermal.V[3]=2 V")):
        done = call("run", "good.toml", *override)
        assert done.exit_code == 0, done.output
    folder = here / "results"
    assert sorted(file.name for file in folder.iterdir()) == [
        *("good.csv", "good.nc", "good.previous.csv", "good.previous.nc")
    ]
    assert "kept, since its settings differ: results/good.previous.nc" in done.stdout
    assert "(modified: thermal.V[3]=2 V)" in done.stdout
    assert results.read(folder / "good.previous.nc")["thermal.V"][-1, 2] == 3.0
    assert "good.previous-2.nc" in call("run", "good.toml", "--set", "thermal.V[3]=1").stdout
    assert call("run", "good.toml", "--name", "other").exit_code == 0
    assert results.read(folder / "other.nc").attrs["scene"] == "other"


def test_a_run_tells_its_outcome(here: Path) -> None:
    lines = call("run", "good.toml").stdout.splitlines()
    lines = lines[lines.index("good") :]
    assert lines[1].startswith("tip at 0.2 s: x ")
    assert lines[1].endswith(" mm")
    assert lines[2].startswith("angles at 0.2 s: x ")
    assert lines[3].startswith("hottest TCA: 3, mean ")
    assert "degC at 0.2 s" in lines[3]
    assert lines[4].startswith("coupling: 2 macro steps, ")


def test_results_beyond_the_limits_are_doubtful(here: Path) -> None:
    hot = ("--set", "thermal.V=[60, 0, 0]")
    done = call("run", "good.toml", *hot)
    assert done.exit_code == 0
    assert "warning: thermal: TCA 1 is hotter than 150 degC from t = " in " ".join(done.stderr.split())
    allowed = (
        "--set",
        "limits.temperature=100000 degC",
        "--set",
        "limits.speed=100",
        "--set",
        "limits.strain=100",
        "--name",
        "hot",
    )
    assert "warning" not in call("run", "good.toml", *hot, *allowed).stderr
    with pytest.warns(tca.SceneWarning, match=r"hotter than 60 degC from t = 0\.[12] s on \(up to \d+ degC\)"):
        tca.run("good.toml", {"thermal.V": 30, "limits.temperature": "60 degC"})


def test_every_manipulator_and_section_is_judged_and_named(here: Path) -> None:
    short = (
        "--set",
        "stop_time=2",
        "--set",
        "upper.V=[60, 0, 0]",
        "--set",
        "limits.speed=100",
        "--set",
        "limits.strain=9",
    )
    done = call("run", "serial", *short)
    assert "warning: upper: TCA 1 is hotter than 150 degC from t = " in " ".join(done.stderr.split())
    assert "\nlower: hottest TCA: 1, mean " in done.stdout
    assert "\nupper: hottest TCA: 1, mean " in done.stdout
    assert "\ntip at 2 s: x " in done.stdout  # of the one rod
    pulled = {"stop_time": 0.2, "limits.strain": 0.03, "right.tip_force": [0.0, 0.0, 0.5]}
    with pytest.warns(tca.SceneWarning, match="right: the body is strained along TCA 1 by more than 3 %"):
        tca.run("gripper", {**pulled, "connections": ["left_heat.T -> left.T", "right_heat.T -> right.T"]})


def test_a_body_strained_beyond_linear_elasticity_is_doubtful(here: Path) -> None:
    """A pull of 0.5 N stretches body and TCAs together by 4.0 %."""
    pulled = ("--set", "thermal.V=[0, 0, 0]", "--set", "rod.tip_force=[0, 0, 0.5]")
    assert "warning" not in call("run", "good.toml", *pulled).stderr
    limited = (*pulled, "--set", "limits.strain=3 %")
    said = " ".join(call("run", "good.toml", *limited).stderr.split())
    assert "rod: the body is strained along TCA 1 by more than 3 % from t = 0 s on (up to 4 %)" in said
    remedy = ("--set", "limits.strain=3 %", "--set", "rod.tip_force=[0, 0, 0.1]", "--name", "mild")
    assert "warning" not in call("run", "good.toml", *pulled, *remedy).stderr


def test_the_version_and_groups_of_commands(here: Path) -> None:
    assert call("--version").stdout == f"tca-cosim {tca.__version__}\n"
    shown = call("--help").stdout
    for group in ("Simulate", "Look at results", "Verify", "Study", "Benchmark"):
        assert group in shown


def test_a_new_scene_runs(here: Path) -> None:
    assert call("new", "mine.toml").exit_code == 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = tca.read("mine.toml")
    default = tca.read("step", {"rod.order": 4})
    for member in scene.members:
        for vector in ("tca.azimuth",):
            assert member.reals(vector) == pytest.approx(default.member(member.name).reals(vector))
        assert member.value("body.length") == default.member(member.name).value("body.length")
    assert isinstance(tca.run(scene, {"stop_time": 0.2}), xr.Dataset)


def test_a_new_sweep_runs_in_the_units_that_people_use(here: Path) -> None:
    assert call("new", "sweep.toml", "--sweep", "there.toml").exit_code == 2
    assert call("new", "sweep.toml", "--sweep", "good.toml").exit_code == 0
    done = call("sweep", "sweep.toml", "--runs", "4", "--workers", "0")
    assert done.exit_code == 0, done.output
    assert "4 runs, 0 finished before, 4 now" in done.stdout
    assert "rod.tip.p[1] [mm]" in done.stdout
    assert "thermal.T[3] [°C]" in done.stdout


def test_keys_are_explained(here: Path) -> None:
    assert call("explain", "coupling.method").stdout.splitlines()[0].startswith("coupling.method: ")
    shown = call("explain", "rod.closure").stdout
    assert "allowed: inside, exchanged" in shown
    assert "unit K" in call("explain", "T_0").stdout
    assert call("explain", "stop_time").stdout.startswith("stop_time: [s]")


def test_a_loop_that_no_method_bears_is_not_told_to_use_its_own_method(here: Path) -> None:
    """100 V heat a TCA by hundreds of kelvin within a step."""
    done = call("run", "step", "--set", "thermal.V=[100, 0, 0]", "--set", "stop_time=1")
    said = " ".join(done.stderr.split())
    assert done.exit_code == 2
    assert "bends too much within this step for coupling.method = 'iqn'" in said
    assert "reduce the inputs" in said
    assert "use coupling.method" not in said
    cooler = call("run", "step", "--set", "thermal.V=[3, 0, 0]", "--set", "stop_time=1")
    assert cooler.exit_code == 0


def test_temperatures_that_may_be_meant_in_celsius_are_doubted(here: Path) -> None:
    said = " ".join(call("run", "good.toml", "--set", "thermal.T_ambient=25").stderr.split())
    assert "warning: --set: thermal.T_ambient = 25: K, which is -248.15 degC; write '25 degC' if meant" in said
    assert "warning" not in call("run", "good.toml", "--set", "thermal.T_ambient=25 degC").stderr
    with pytest.warns(tca.SceneWarning, match=r"rod\.T_0 = 25: K, .* write '25 degC' if meant"):
        tca.read("good.toml", {"rod.T_0": 25, "connections": []})
