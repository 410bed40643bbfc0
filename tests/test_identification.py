"""Identification: coverage of intervals, sets that the data cannot tell, the paper's figure, files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
import tca_cosim.cli
import xarray as xr
from tca_cosim.fmi.derivatives import jacobian
from tca_cosim.identification import (
    Measurements,
    bootstrap,
    identify,
    measurements_of,
    read_free,
    read_measurements,
)
from tca_cosim.identification.fit import Fit
from tca_cosim.identification.predictions import Predictor
from tca_cosim.identification.report import warnings_of
from tca_cosim.parallel import spread
from tca_cosim.scene import Scene
from tca_cosim.verification.paper import data as paper
from typer.testing import CliRunner

SHORT = {"rod.closure": "inside", "stop_time": 4.0, "coupling.macro_step": 0.2, "rod.order": 0}
TRUE = {"thermal.tca.R": 6.9, "rod.tca.rho_T": 6.5e-4}
NOISE = {"thermal.T": 0.3, "rod.tip.p": 2e-4}
DATA = Path(__file__).parent / "data"
MEASURED_LAW = {  # of Sun et al. (2021), type 1-180; tests/cpp/rod_parts.cpp has it too
    "rod.body.length": 88.29e-3,
    "rod.tca.stiffness": 2.506,
    "rod.tca.stiffening": 148.0,
    "rod.tca.stroke": 1.499e-4,
    "rod.tca.stroke_curvature": 1.775e-6,
    "rod.tca.stop": -12.6e-3,
    "rod.tca.stop_stiffness": 30.3,
}


@pytest.fixture(scope="module")
def scene() -> Scene:
    return tca.read("step", SHORT)


@pytest.fixture(scope="module")
def exact(scene: Scene) -> xr.Dataset:
    return tca.run(scene)


def measured(scene: Scene, exact: xr.Dataset, random: np.random.Generator, outputs: dict[str, float]) -> Measurements:
    """Every second macro step of each output, with noise."""
    times = exact["time"].to_numpy()[2::2]
    values = {}
    for vector, deviation in outputs.items():
        for k in range(3):
            values[f"{vector}[{k + 1}]"] = exact[vector].to_numpy()[2::2, k] + deviation * random.standard_normal(
                times.size
            )
    return measurements_of(scene, times, values)


def covered(scene: Scene, exact: xr.Dataset, repeats: int, known: bool) -> np.ndarray:
    random = np.random.default_rng(5)
    free = read_free(scene, ["thermal.tca.R=4:10", "rod.tca.rho_T=1e-4:2e-3"])
    hits = []
    for _ in range(repeats):
        estimate = identify([(scene, measured(scene, exact, random, NOISE))], free, noise=NOISE if known else None)
        inside = (estimate.intervals[:, 0] <= list(TRUE.values())) & (list(TRUE.values()) <= estimate.intervals[:, 1])
        hits.append(inside)
    return np.mean(hits, axis=0)


def test_intervals_cover_the_true_values(scene: Scene, exact: xr.Dataset) -> None:
    """A short sample; 200 repeats by hand cover 90 to 98 %."""
    assert (covered(scene, exact, 6, known=True) >= 0.66).all()


def test_noise_is_estimated_and_offsets_are_found(scene: Scene, exact: xr.Dataset) -> None:
    data = measured(scene, exact, np.random.default_rng(1), NOISE)
    values = data.values.copy()
    values[:, 1] += 2.0  # a sensor of temperature
    values[3:7, 4] = np.nan  # missing samples
    data = Measurements(data.times, data.outputs, values)
    estimate = identify([(scene, data)], read_free(scene, list(TRUE)), offsets=["thermal.T[2]"])
    assert estimate.names == ("thermal.tca.R", "rod.tca.rho_T", "offset(thermal.T[2])")
    assert estimate.units == ("ohm", "1/K", "K")
    assert estimate.noise["thermal.T"] == pytest.approx(0.3, rel=0.5)
    assert estimate.noise["rod.tip.p"] == pytest.approx(2e-4, rel=0.5)
    assert np.abs((estimate.values - [6.9, 6.5e-4, 2.0]) / estimate.deviations).max() < 4.0
    assert estimate.undetermined == ()


def test_stiffness_is_not_told_by_angles_alone(scene: Scene, exact: xr.Dataset) -> None:
    """Angles depend on the ratio of the moduli of body and wire; a prior on one of them tells the other."""
    random = np.random.default_rng(2)
    data = measured(scene, exact, random, {"rod.tip.euler": 1e-3})
    free = ["rod.body.E", "rod.tca.E"]
    estimate = identify([(scene, data)], read_free(scene, free), noise={"rod.tip.euler": 1e-3})
    assert estimate.undetermined == (("rod.body.E", "rod.tca.E"),)
    prior = identify(
        [(scene, data)], read_free(scene, ["rod.body.E", "rod.tca.E~560e6:5e6"]), noise={"rod.tip.euler": 1e-3}
    )
    assert prior.undetermined == ()
    assert abs(prior.values[0] - 37.8e3) < 4.0 * prior.deviations[0]


def figure(name: str) -> tuple[Scene, Measurements]:
    """One scene of the paper's Fig. 3 as measurements."""
    scene, readings = tca.read(name), paper.readings(name)
    sharp = {series: reading.sharp() for series, reading in readings.items()}
    times = np.unique(np.concatenate([r.time for r in sharp.values()]))
    values = {}
    for k, (T, angle) in enumerate(zip(paper.TEMPERATURES, paper.ANGLES, strict=True), 1):
        for series, output, factor, shift in (
            (T, f"thermal.T[{k}]", 1.0, 273.15),
            (angle, f"rod.tip.euler[{k}]", -1.0, 0.0),
        ):
            if not sharp[series].time.size:
                continue
            values[output] = np.full(times.size, np.nan)
            values[output][np.searchsorted(times, sharp[series].time)] = factor * sharp[series].value + shift
    return scene, measurements_of(scene, times, values)


@pytest.mark.slow
def test_the_papers_figure_is_fitted_as_well_as_by_its_set(at_most) -> None:
    experiments = [figure(name) for name in paper.SCENES]
    free = ["thermal.tca.R", "thermal.body.rho_c", "thermal.tca.rho_c", "rod.tca.rho_T"]
    estimate = identify(experiments, read_free(experiments[0][0], free))
    at_most("temperatures of the figure [K rms]", estimate.residuals["thermal.T"], 0.21)
    at_most("angles of the figure [rad rms]", estimate.residuals["rod.tip.euler"], 0.035)
    assert estimate.undetermined == ()
    np.testing.assert_allclose(estimate.values, [6.9, 0.669e6, 0.969e6, 6.5e-4], rtol=0.03)
    assert estimate.parameters().keys() == set(free)


def test_the_command_writes_a_parameter_set(scene: Scene, exact: xr.Dataset, tmp_path: Path) -> None:
    pytest.importorskip("tomli_w")
    data = measured(scene, exact, np.random.default_rng(4), NOISE)
    head = "time [s]," + ",".join(f"thermal.T[{k}] [degC]" for k in (1, 2, 3))
    celsius = data.values[:, :3] - 273.15
    rows = [",".join([f"{t}", *(f"{v}" for v in row)]) for t, row in zip(data.times, celsius, strict=True)]
    (tmp_path / "data.csv").write_text("\n".join([head, *rows]))
    arguments = ["identify", "step", "--data", str(tmp_path / "data.csv"), "--out", str(tmp_path)]
    arguments += ["--free", "thermal.tca.R"]
    arguments += [text for key, value in SHORT.items() for text in ("--set", f"{key}={value}")]
    result = CliRunner().invoke(tca.cli.app, arguments)
    assert result.exit_code == 0, result.output
    other = tca.read("switch", {"parameters": str(tmp_path / "step.parameters.toml")})
    assert other.member("thermal").reals("tca.R") == pytest.approx((6.9,) * 3, rel=0.05)
    assert (tmp_path / "step.estimate.json").is_file()


def test_lengths_of_a_hanging_tca_give_the_measured_law(tmp_path: Path, at_most) -> None:
    """From rough values on: load stiffening, curved stroke and the stop, from 73 lengths read off a figure."""
    pytest.importorskip("tomli_w")
    arguments = ["identify", str(DATA / "hanging_tca.toml"), "--data", str(DATA / "hanging_tca_lengths.csv")]
    arguments += ["--free", " ".join(MEASURED_LAW), "--set", "rod.tca.stop_width=6 mm", "--out", str(tmp_path)]
    result = CliRunner().invoke(tca.cli.app, arguments)
    assert result.exit_code == 0, result.output
    assert "do not tell" not in result.output
    assert "not converged" not in result.output
    written = json.loads((tmp_path / "hanging_tca.estimate.json").read_text(encoding="utf-8"))
    at_most("measured lengths [m rms]", written["residuals_rms"]["rod.tip.p"], 0.6e-3)
    np.testing.assert_allclose(written["values"], list(MEASURED_LAW.values()), rtol=2e-3)
    low, high = np.array(written["intervals_95"]).T
    assert ((low < list(MEASURED_LAW.values())) & (list(MEASURED_LAW.values()) < high)).all()
    other = tca.read("hang", {"parameters": str(tmp_path / "hanging_tca.parameters.toml"), "body.length": 88.29e-3})
    rod = other.member("rod")
    assert rod.choice("tca.law") == "measured"
    assert rod.reals("tca.stiffness") == pytest.approx((2.506,) * 3, rel=2e-3)
    assert rod.reals("tca.stop_width") == (6e-3,) * 3


@pytest.mark.slow
def test_what_lengths_alone_do_not_tell_of_the_stop_is_named() -> None:
    scene = tca.read(DATA / "hanging_tca.toml")
    data = read_measurements(scene, DATA / "hanging_tca_lengths.csv")
    free = read_free(scene, [*MEASURED_LAW, "rod.tca.stop_width"])
    estimate = identify([(scene, data)], free, noise={"rod.tip.p": 5e-4})
    stop = ("rod.tca.stop", "rod.tca.stop_stiffness", "rod.tca.stop_width")
    assert estimate.undetermined == (stop,)
    assert estimate.residuals["rod.tip.p"] < 0.6e-3


def test_differences_are_the_derivatives_that_the_rod_gives() -> None:
    """In equilibria, where derivatives at an instant by tunable parameters are those of the whole run."""
    scene = tca.read(DATA / "hanging_tca.toml", {**MEASURED_LAW, "rod.tca.stop_width": 6e-3})
    data = read_measurements(scene, DATA / "hanging_tca_lengths.csv")
    names = [name for name in MEASURED_LAW if name.startswith("rod.tca")]
    fit = Fit([Predictor(scene, data)], read_free(scene, names), {"rod.tip.p": 1.0}, ())
    differences = -fit.jacobian(fit.start()) / fit.scales
    variables, rows = scene.member("rod").archive.variables, []
    with tca.Simulation(scene) as sim:
        for time in data.times[:20]:
            if time > 0.0:
                sim.step(time)
            known = [variables[f"{name.removeprefix('rod.')}[1]"] for name in names]
            rows.append(jacobian(sim.instance("rod"), [variables["tip.p[3]"]], known)[0])
    size = np.abs(differences).max(axis=0)
    assert (np.abs(differences[:20] - rows) / size).max() < 1e-5


class Decay:
    """Predicts exp(-k t) in place of a scene's FMUs; cannot run for k < 0."""

    def __init__(self, scene: Scene, measured: Measurements, threads: int | None = None) -> None:
        self.scene, self.measured, self.runs, self.failure, self.refused = scene, measured, 0, "", 0

    def __call__(self, names: list[str], table: np.ndarray) -> np.ndarray:
        rows = np.exp(-table[:, :1] * self.measured.times)
        self.refused += int((table[:, 0] < 0.0).sum())
        self.failure = "diverges" if (table[:, 0] < 0.0).any() else ""
        rows[table[:, 0] < 0.0] = np.nan
        return rows[:, :, None]


@pytest.mark.parametrize(("start", "refused"), [(1.0, False), (14.0, True)])
def test_steps_to_parameters_that_cannot_be_run_are_shortened(scene: Scene, start: float, refused: bool) -> None:
    times = np.linspace(0.05, 1.0, 20)
    model = Decay(scene, Measurements(times, ("thermal.T[1]",), np.exp(-0.3 * times)[:, None]))
    (k,) = read_free(scene, ["thermal.h=0:1e3"])
    fit = Fit([model], (replace(k, start=start, least=-1e3),), {"thermal.T": 1.0}, ())  # type: ignore[list-item]
    assert fit.solve(fit.start())[0] * start == pytest.approx(0.3, rel=1e-6)
    assert fit.converged
    assert bool(model.refused) == refused
    beside = np.array([1e-3]) / start  # nearer to the edge than a step of the differences
    assert fit.jacobian(beside)[0, 0] == pytest.approx(start * times[0], rel=1e-2)
    with pytest.raises(tca.CosimError, match=r"diverges; start elsewhere \(--set\), or give narrower bounds"):
        fit.solve(-fit.start())


def test_bootstrap_intervals_are_those_of_the_linear_theory_where_it_holds(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tca_cosim.identification.resampling.Predictor", Decay)
    monkeypatch.setattr("tca_cosim.identification.estimate.Predictor", Decay)
    times = np.linspace(0.05, 3.0, 60)
    noisy = np.exp(-0.8 * times) + 0.02 * np.random.default_rng(2).standard_normal(times.size)
    data = Measurements(times, ("thermal.T[1]",), noisy[:, None])
    (k,) = read_free(scene, ["thermal.h=0.01:100"])
    estimate = identify([(scene, data)], [replace(k, start=2.0)])
    assert abs(estimate.values[0] - 0.8) < 4.0 * estimate.deviations[0]
    resampled = bootstrap([(scene, data)], estimate, 400)
    assert resampled.failed == 0
    assert resampled.deviations[0] == pytest.approx(estimate.deviations[0], rel=0.15)  # 4 % from 400 repeats alone
    np.testing.assert_allclose(resampled.intervals, estimate.intervals, atol=0.5 * estimate.deviations[0])
    with pytest.raises(tca.SceneError, match="give 20 or more"):
        bootstrap([(scene, data)], estimate, 5)


@pytest.mark.slow
def test_bootstrap_by_dask_is_that_of_one_process(scene: Scene, exact: xr.Dataset) -> None:
    pytest.importorskip("distributed")
    data = measured(scene, exact, np.random.default_rng(6), {"thermal.T": 0.3})
    estimate = identify([(scene, data)], read_free(scene, ["thermal.tca.R"]), noise={"thermal.T": 0.3})
    here = bootstrap([(scene, data)], estimate, 20, seed=1)
    there = bootstrap([(scene, data)], estimate, 20, seed=1, worker=lambda tasks: spread(tasks, workers=1))
    np.testing.assert_allclose(there.values, here.values, rtol=1e-12)
    assert here.deviations[0] == pytest.approx(estimate.deviations[0], rel=0.6)


@pytest.mark.parametrize(
    ("free", "message"),
    [
        ("thermal.tca.Q", "not a real parameter; did you mean"),
        ("heat.R", "no FMU 'heat'"),
        ("thermal.tca.R=9:3", "lower bound"),
        ("thermal.tca.R=low:high", "two numbers"),
        ("thermal.tca.R~7:0", "standard deviation is positive"),
        ("thermal.tca.R~7:nan", "standard deviation is positive"),
        ("thermal.tca.R=-9:-3", "no value in these bounds is allowed; allowed: 1e-09 to"),
        ("thermal.tca.alpha_T", "starts at 0, which does not tell its size; give bounds"),
    ],
)
def test_wrong_parameters_are_refused(scene: Scene, free: str, message: str) -> None:
    with pytest.raises(tca.SceneError, match=message):
        read_free(scene, [free])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,thermal.T[9]\n1,300\n", "no such output"),
        ("time,heat.T\n1,300\n", "no FMU 'heat'"),
        ("time,thermal.T[1]\n9,300\n", "set stop_time"),
        ("time,thermal.T[1]\n1,\n2,\n", "has no sample"),
        ("time,thermal.T[1]\n2,300\n1,300\n", "time 1 s in row 2 after 2 s; give finite times that increase"),
        ("time,thermal.T[1]\n1,300\n1,300\n", "time 1 s in row 2 after 1 s"),
        ("time,thermal.T[1]\n,300\n1,300\n", "time nan s in row 1; give finite times"),
        (f"time,thermal.T[1]\n1,{'9' * 200_000}\n", r"data\.csv: no table \(field larger than"),
        ("time,thermal.T[1] [V]\n1,300\n", "unit"),
        ("", "no rows"),
        ("# nothing but a comment\n", "no rows"),
        ("time,thermal.T[1],thermal.T[1]\n1,300,300\n", r"two columns 'thermal\.T\[1\]'; keep one"),
        ("time,thermal.T[1]\n1,inf\n", "finite or missing"),
        ("time,rod.tip.p\n1,0\n", "no such output"),
    ],
)
def test_wrong_data_are_refused(scene: Scene, text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text(text)
    with pytest.raises(tca.SceneError, match=message):
        read_measurements(scene, tmp_path / "data.csv")


@pytest.mark.parametrize(
    ("free", "message"),
    [
        (["thermal.tca.R", "thermal.tca.R"], r"thermal\.tca\.R: it is named twice; name it once"),
        (["thermal.tca.R", "thermal.tca.R[2]"], r"both set thermal\.tca\.R\[2\]; free one of them"),
        (["rod.body.E", "rod.segment.E[1]"], r"rod\.body\.E and rod\.segment\.E\[1\]: both set rod\.segment\.E\[1\]"),
    ],
)
def test_no_parameter_is_free_twice(scene: Scene, free: list[str], message: str) -> None:
    with pytest.raises(tca.SceneError, match=message):
        read_free(scene, free)
    assert len(read_free(scene, ["thermal.tca.R[1]", "thermal.tca.R[2]", "rod.body.E"])) == 3


def test_what_the_data_do_not_touch_is_named_in_finite_numbers(scene: Scene, exact: xr.Dataset) -> None:
    """A density in a quasi-static scene: alone, and with a prior that is all there is to know."""
    data = measurements_of(scene, exact["time"].to_numpy()[1:], {"thermal.T[3]": exact["thermal.T"].to_numpy()[1:, 2]})
    alone = identify([(scene, data)], read_free(scene, ["rod.body.rho"]))
    assert alone.undetermined == (("rod.body.rho",),)
    assert np.isfinite([*alone.deviations, *alone.intervals.ravel(), *alone.correlations.ravel()]).all()
    known = identify([(scene, data)], read_free(scene, ["rod.body.rho~1000:10"]))
    assert known.deviations[0] == pytest.approx(10.0)
    assert "the data add nothing to the prior of rod.body.rho; measure what depends on it" in warnings_of(known)


def test_options_of_the_command_that_contradict_each_other(scene: Scene, exact: xr.Dataset, tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    rows = zip(exact["time"].to_numpy()[1:], exact["thermal.T"].to_numpy()[1:, 2], strict=True)
    path.write_text("time,thermal.T[3]\n" + "".join(f"{t},{T}\n" for t, T in rows), encoding="utf-8")
    base = ["identify", "step", "--data", str(path), "--free", "thermal.tca.R", "--out", str(tmp_path)]
    for options, message in (
        (["--noise", "thermal.T=0.2", "--noise", "thermal.T=0.3"], "--noise thermal.T=0.3: given twice; keep one"),
        (["--noise", "thermal.T=inf"], "give a positive, finite standard deviation"),
        (["--noise", "thermal.T[3]=0.2"], "give that of the whole vector; measured are thermal.T"),
        (["--also", f"step={path}"], "these measurements are there already; give each once"),
        (["--free", "thermal.h=-3:-1"], "--free thermal.h=-3:-1: no value in these bounds"),  # and no emoji
    ):
        outcome = CliRunner().invoke(tca.cli.app, [*base, *options])
        assert outcome.exit_code == 2
        assert message in outcome.output
    assert list(tmp_path.iterdir()) == [path]


def test_semicolons_and_other_units_of_time_are_read(scene: Scene, tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text("time [ms];thermal.T[1] [degC]\n1000;25\n2000;\n", encoding="utf-8")
    data = read_measurements(scene, tmp_path / "data.csv")
    np.testing.assert_allclose(data.times, [1.0, 2.0])
    np.testing.assert_allclose(data.values[:, 0], [298.15, np.nan])


def test_a_fit_that_explains_nothing_is_named(scene: Scene, exact: xr.Dataset) -> None:
    """Degrees Celsius taken as kelvin."""
    celsius = exact["thermal.T"].to_numpy()[1:, 2] - 273.15
    data = measurements_of(scene, exact["time"].to_numpy()[1:], {"thermal.T[3]": celsius})
    estimate = identify([(scene, data)], read_free(scene, ["thermal.tca.R=1:20"]))
    assert any("the fit says nothing of thermal.T" in text for text in warnings_of(estimate))
    right = measurements_of(scene, data.times, {"thermal.T[3]": celsius + 273.15})
    assert not warnings_of(identify([(scene, right)], read_free(scene, ["thermal.tca.R=1:20"])))


def test_one_value_does_not_stand_for_elements_that_differ() -> None:
    scene = tca.read("step", {"thermal.tca.R": [6.9, 7.0, 7.1]})
    with pytest.raises(tca.SceneError, match=r"free them one by one: thermal\.tca\.R\[1\] thermal\.tca\.R\[2\]"):
        read_free(scene, ["thermal.tca.R"])
    assert [p.start for p in read_free(scene, ["thermal.tca.R[2]"])] == [7.0]
    with pytest.raises(tca.SceneError, match=r"segments values of their own; free those: rod\.segment\.E\[1\]"):
        read_free(tca.read("step", {"rod.segment.E[1]": 30e3}), ["rod.body.E"])
