"""Charts of speed against accuracy: the norm and the front on known data, a small chart from end to end."""

from __future__ import annotations

import contextlib
import csv
import json
import math
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import tca_cosim
import xarray as xr
from tca_cosim import results
from tca_cosim.benchmarks import work_precision
from tca_cosim.benchmarks.work_precision.norm import ErrorNorm, pareto_front, values_at
from tca_cosim.benchmarks.work_precision.reference_solution import solve_reference
from tca_cosim.benchmarks.work_precision.series import read_series
from tca_cosim.benchmarks.work_precision.solvers import SOLVERS, CoSimulation, TimeLimitError
from tca_cosim.errors import CosimError
from tca_cosim.fmi.archive import cached_archive
from tca_cosim.scene import read
from test_cli import tca

SMALL = """
outputs = 4
[panels]
all = "a small chart"
[reference.coarse]
set = ["thermal.tolerance=1e-5", "rod.order=2"]
tolerance = 1e-6
[reference.fine]
set = ["thermal.tolerance=1e-6", "rod.order=3"]
tolerance = 1e-8
[[series]]
name = "ours"
panel = "all"
set = ["rod.closure=inside"]
sweep = { "rod.order" = [0, 2], steps = [1, 2] }
[[series]]
name = "iterated plainly"
panel = "all"
set = ["coupling.method=plain"]
[[series]]
name = "too slow"
panel = "all"
set = ["rod.dynamic=true", "rod.tolerance=1e-10", "rod.closure=inside"]
sweep = { steps = [3000] }
[[series]]
name = "far off"
panel = "all"
set = ["thermal.tca.R=0.5"]
[[series]]
name = "monolith"
panel = "all"
solver = "monolith"
[[series]]
name = "scipy"
panel = "all"
solver = "reference"
sweep = { edge = [0.3], heat_step = [0.5], shooting = [1e-4] }
[[series]]
name = "only of moving rods"
panel = "all"
scenes = "motion"
"""


def course(**quantities: np.ndarray) -> xr.Dataset:
    times = np.array([0.0, 1.0, 2.0])
    return xr.Dataset(
        {name.replace("_", "."): (("time", "index2"), values) for name, values in quantities.items()}, {"time": times}
    )


# -- norm and front ----------------------------------------------------------------------------------------------------


def test_the_norm_on_known_data() -> None:
    """Temperatures range over 20 K, of the element that varies most; off by 2 K and 1 K at one time each."""
    truth = course(
        thermal_T=np.array([[300.0, 300.0], [310.0, 301.0], [320.0, 302.0]]), rod_delta=np.array([[1e-3, 0.0]] * 3)
    )
    run = course(
        thermal_T=np.array([[9.0, 9.0], [312.0, 301.0], [320.0, 301.0]]), rod_delta=np.array([[2e-3, 0.0]] * 3)
    )
    norm = ErrorNorm.from_reference(truth, truth["time"].to_numpy())
    assert norm.ranges == {"thermal.T": 20.0}  # what rests is left out, and so is the start
    assert norm.error(run) == pytest.approx(math.sqrt((0.1**2 + 0.05**2) / 4), rel=1e-12)
    assert norm.axis() == "error: RMS over 2 times of T, each over its range [1]"
    with pytest.raises(CosimError, match="no value at t = 1 s"):
        norm.error(run.isel(time=[0, 2]))
    with pytest.raises(CosimError, match="varies in this scene"):
        ErrorNorm.from_reference(truth.drop_vars("thermal.T"), truth["time"].to_numpy())


def test_the_front_on_known_data() -> None:
    errors = np.array([1e-1, 1e-2, 1e-2, 1e-3, 2e-3, np.inf, 1e-4])
    costs = np.array([1.0, 2.0, 2.0, 4.0, 5.0, 0.1, np.nan])
    np.testing.assert_array_equal(pareto_front(errors, costs), [True, True, True, True, False, False, False])


def test_values_of_many_rows_take_linear_memory() -> None:
    """1e5 rows at 1e5 times: a matrix of differences would take 80 GB."""
    there = np.linspace(0.0, 10.0, 100_001)
    result = xr.Dataset({"rod.delta": (("time", "index3"), np.outer(there, [1.0, 2.0, 3.0]))}, {"time": there})
    tracemalloc.start()
    actual = values_at(result, "rod.delta", there * (1.0 + 1e-12))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    np.testing.assert_array_equal(actual[:, 1], 2.0 * there)
    assert peak < 30 * there.nbytes
    with pytest.raises(CosimError, match=r"no value at t = 5\.00005 s"):
        values_at(result, "rod.delta", np.array([0.0, 5.00005, 10.0]))


def test_times_are_equal_to_rounding() -> None:
    result = xr.Dataset({"rod.delta": ("time", np.array([0.0, 1.0, 4.0]))}, {"time": [0.0, 1.0, 2.0]})
    for times in ([0.0, 1.0, 2.0], [1e-12, 1.0 - 1e-12, 2.0 - 1e-12], [-1e-12, 1.0 + 1e-12, 2.0 + 1e-12]):
        assert values_at(result, "rod.delta", np.array(times)).ravel().tolist() == [0.0, 1.0, 4.0]


# -- series ------------------------------------------------------------------------------------------------------------


def test_every_solver_has_a_series_and_every_scene_points_of_every_panel() -> None:
    own = read_series()
    assert {series.solver for series in own.series} == set(SOLVERS)
    for name in ("step", "drop"):
        scene = tca_cosim.read(name)
        trials = own.trials(scene)
        assert {trial.panel for trial in trials} == set(own.panels)
        for trial in trials:
            read(name, trial.overrides, cached_archive)  # refuses what does not exist


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('solver = "monolith"', 'solver = "monolit"', "did you mean 'monolith'"),
        ('panel = "all"', 'panel = "al"', "did you mean 'all'"),
        ("steps = [1, 2]", "steps = [1]", "one length"),
        ("steps = [1, 2]", "step = [1, 2]", "did you mean 'steps'"),
        ("[reference.coarse]", "[refernce.coarse]", "coarse"),
        ("[panels]", "[panels", "cannot be read"),
    ],
)
def test_mistakes_in_a_file_of_series_are_named(old: str, new: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(SMALL.replace(old, new, 1))
    with pytest.raises(CosimError, match=said):
        read_series(tmp_path / "mine.toml")


# -- a chart -----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    file = tmp_path_factory.mktemp("chart") / "small.toml"
    file.write_text(SMALL)
    return work_precision.run_chart("step", ["stop_time=2"], repeats=3, limit=0.5, file=file)


def test_every_point_is_in_the_table_with_its_settings(small: xr.Dataset) -> None:
    names = ["ours", "ours", "iterated plainly", "too slow", "far off", "monolith", "scipy"]
    assert small["series"].to_numpy().tolist() == names
    assert small["settings"][1] == "rod.closure=inside, rod.order=2, steps=2"
    good = np.array([name in ("ours", "monolith", "scipy") for name in names])
    np.testing.assert_array_equal(np.isfinite(small["error"]), good)
    np.testing.assert_array_equal(small["runs"], np.where(good, 3, 0))
    assert bool((small["cold"] > 0).all())
    assert bool((small["time_low"][good] <= small["time"][good]).all())
    assert bool((small["time"][good] <= small["time_high"][good]).all())
    assert 4 <= small["work"][0] < small["work"][1]  # at least one in each step
    for key in ("commit", "machine", "versions", "fmus", "sources", "axis", "reference", "floor", "status"):
        assert key in small.attrs
    assert set(json.loads(small.attrs["fmus"])) == {"thermal", "rod"}
    assert 0.0 < small.attrs["floor"] < 1e-3
    assert float(small["error"][1]) < 1e-3
    assert float(small["error"][6]) < 0.1


def test_failures_say_why(small: xr.Dataset) -> None:
    said = dict(zip(small["series"].to_numpy().tolist(), small["failure"].to_numpy().tolist(), strict=True))
    assert said["ours"] == said["scipy"] == ""
    assert "coupling failed" in said["iterated plainly"]
    assert "stopped at t =" in said["too slow"]
    assert "of the range" in said["far off"]


def test_failures_are_drawn_at_the_edge(small: xr.Dataset) -> None:
    (panel,) = work_precision.plot.panels(small)
    above = work_precision.plot.draw(small, panel).axes[0]
    crosses = [line for line in above.lines if line.get_marker() == "x"]
    assert len(crosses) == 3
    right = above.get_xlim()[1]
    assert all(right / 10 < x < right for line in crosses for x in line.get_xdata())


def test_the_table_is_written_whole(small: xr.Dataset, tmp_path: Path) -> None:
    work_precision.write_csv(small, tmp_path / "there" / "small.csv")
    lines = (tmp_path / "there" / "small.csv").read_text().splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("# ")))
    assert [float(row["error [1]"]) for row in rows] == small["error"].to_numpy().tolist()
    assert {"time [s]", "cold [s]", "settings [1]", "failure [1]", "work [1]", "front [1]"} <= set(rows[0])
    results.write(small, tmp_path / "small.nc")
    xr.testing.assert_equal(results.read(tmp_path / "small.nc")["error"], small["error"])


def test_the_best_of_each_solver(small: xr.Dataset) -> None:
    actual = work_precision.fastest_points(small, 0.1)
    assert set(actual) == {"cosimulation", "monolith", "reference"}
    times = small["time"].to_numpy()
    assert times[actual["cosimulation"]] == np.nanmin(times[:2])
    assert work_precision.fastest_points(small, 0.0) == {}


def test_a_run_begun_again_is_the_same() -> None:
    times = np.linspace(0.0, 1.0, 5)
    solver = CoSimulation("step", ["stop_time=1"], times, steps=2)
    solver.run(math.inf)
    first, work = solver.result(), solver.work
    solver.rewind()
    solver.run(math.inf)
    again = solver.result()
    xr.testing.assert_identical(first, again)
    assert solver.work == work >= 8  # counted once
    solver.close()


@pytest.mark.parametrize(("solver", "scene"), [*((solver, "step") for solver in SOLVERS), ("reference", "drop")])
def test_the_limit_ends_every_first_run(solver: str, scene: str) -> None:
    times = np.linspace(0.0, 0.2, 3)
    tried = SOLVERS[solver](scene, ["stop_time=0.2"], times)
    with contextlib.closing(tried), pytest.raises(TimeLimitError, match=r"stopped at t = .* of CPU time") as late:
        tried.run(1e-9)
    assert str(late.value).startswith("search for a level") is (solver == "auto")


def test_a_truth_says_how_far_it_is(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(SMALL)
    heard: list[tuple[int, float]] = []
    work_precision.reference_solutions(
        ["step"], ["stop_time=1"], tmp_path / "small.toml", progress=lambda *shares: heard.append(shares)
    )
    assert heard == [(number, share) for number in (0, 1) for share in (0.0, 0.25, 0.5, 0.75, 1.0)]


@pytest.mark.parametrize("scene", ["push", "plain"])
def test_a_choice_has_no_inertia_where_the_truth_has_none(scene: str) -> None:
    """A choice that is free adds it there and lies 1.3e-3 and 2.5e-3 of the ranges off a truth without."""
    times = np.linspace(0.0, read(scene).stop_time, 31)
    norm = ErrorNorm.from_reference(solve_reference(scene, [], times, read_series().reference["coarse"]), times)
    with contextlib.closing(SOLVERS["auto"](scene, [], times, tolerance=1e-3)) as solver:
        solver.run(math.inf)
        assert norm.error(solver.result()) <= 1e-3


@pytest.mark.parametrize(("steps", "wanted"), [(1, 4 + 1), (2, 2 * 4 + 1)])
def test_a_jump_between_outputs_costs_a_step(steps: int, wanted: int) -> None:
    """At 7.03 s, of outputs every 2.5 s: 5 to 7.5 s is 2.03 s and 0.47 s long."""
    times = np.linspace(0.0, 10.0, 5)
    solver = CoSimulation("jump", ["stop_time=10", "rod.closure=inside"], times, steps)
    solver.run(math.inf)
    assert solver.result().sizes["time"] == 1 + wanted
    assert 7.03 in solver.result()["time"]
    solver.close()


def test_command(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(SMALL)
    short = ["--set", "stop_time=1", "--out", "there"]
    done = tca("chart", "step", *short, "--repeats", "1", "--limit", "0.3", "--series", "small.toml", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "scipy/ours" in done.stdout
    names = {f"chart_step{ending}" for ending in (".csv", ".nc", "_all.png", "_all.svg")}
    assert {file.name for file in (tmp_path / "there").iterdir()} == names
    done = tca("halving", "step", *short, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "there" / "halving_step.nc").is_file()
    done = tca("chart", "step", "--panel", "solver", folder=tmp_path)
    assert done.returncode == 2
    assert "did you mean 'solvers'" in done.stderr
