"""Sweeps: designs, distributions, indices, datasets, figures, runs that are finished already."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from scipy import stats
from scipy.stats import qmc
from sweep_plans import TWO, plan
from tca_cosim import CosimError, results
from tca_cosim.files import save_figure
from tca_cosim.fmi.archive import cached_archive, find_fmu
from tca_cosim.parallel import serial
from tca_cosim.studies import many_runs, sweep
from tca_cosim.studies.sweep import chart, design, sensitivity

# -- designs and distributions


def test_designs_are_scipys() -> None:
    assert np.array_equal(design.samples("sobol", 8, 3, [0, 0]), qmc.Sobol(2, rng=3).random(8))
    assert np.array_equal(design.samples("latin", 7, 3, [0, 0]), qmc.LatinHypercube(2, rng=3).random(7))
    assert np.array_equal(design.samples("random", 7, 3, [0, 0]), np.random.default_rng(3).random((7, 2)))
    middles = [[i + 0.5, j + 0.5] for i in (0, 1) for j in (0, 1, 2)]
    assert np.array_equal(design.samples("grid", 6, 3, [2, 3]) * [2, 3], middles)


@pytest.mark.parametrize("name", ["sobol", "random"])
def test_more_runs_keep_the_first_ones(name: str) -> None:
    assert np.array_equal(design.samples(name, 100, 1, [0])[:10], design.samples(name, 10, 1, [0]))


def test_points_follow_their_distribution(tmp_path: Path) -> None:
    actual = plan(tmp_path, head="runs = 64\n")
    u = qmc.Sobol(2, rng=1).random(64)
    h, E = np.array(actual.values).T.tolist()
    assert h == pytest.approx(list(15.0 + 10.0 * u[:, 0]), rel=1e-15)
    assert pytest.approx(list(stats.lognorm(0.1, scale=37800.0).ppf(u[:, 1])), rel=1e-15) == E
    assert actual.run_overrides()[5] == (f"thermal.h={h[5]!r}", f"rod.body.E={E[5]!r}")  # to the last bit


def test_grids_and_lists(tmp_path: Path) -> None:
    text = """
    [parameters]
    "rod.strains" = ["bending", "extensible"]
    "thermal.T_ambient, thermal.T_0" = ["25 degC"]
    "thermal.h" = { uniform = { loc = 15, scale = 10 }, levels = 2 }
    "rod.start_at_equilibrium" = [true, false]
    """
    actual = plan(tmp_path, text, head="design = 'grid'\n")
    assert len(actual.values) == actual.settings.runs == 8
    assert actual.values[1] == ("bending", 298.15, 17.5, False)
    assert actual.run_overrides()[7] == (
        "rod.strains=extensible",
        "thermal.T_ambient=298.15",
        "thermal.T_0=298.15",
        "thermal.h=22.5",
        "rod.start_at_equilibrium=false",
    )


def test_overrides_win_over_those_of_the_file(tmp_path: Path) -> None:
    """--set on the command line comes after `set` of the file, key by key, and before the parameters of each run."""
    (tmp_path / "mine.toml").write_text(
        'runs = 4\nscene = "step"\nset = ["stop_time=0.3", "thermal.tolerance=1e-2", "rod.order=1"]\n'
        'outputs = ["rod.tip.p"]\n' + TWO
    )
    planned = sweep.read_plan(tmp_path / "mine.toml", overrides=["thermal.tolerance=1e-3", "stop_time=0.2"])
    assert planned.scene.stop_time == 0.2
    assert planned.scene.member("thermal").real("tolerance") == 1e-3
    assert planned.scene.member("rod").real("order") == 1
    task = sweep.SweepTask(planned.source, planned.overrides, ("rod.order=0",), planned.outputs, planned.times)
    assert task().series.shape == (3, 3)
    read = tca.read(planned.source, planned.overrides)  # as every run reads it
    assert (read.stop_time, read.member("thermal").real("tolerance")) == (0.2, 1e-3)


def test_sobol_indices_of_a_known_function() -> None:
    """Ishigami: S1 = 0.3139, 0.4424, 0; total 0.5576, 0.4424, 0.2437 (a = 7, b = 0.1)."""
    u = design.samples("saltelli", 5 * 4096, 1, [0, 0, 0])
    x = np.pi * (2.0 * u - 1.0)
    y = np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    first, total = sensitivity.sobol_indices(3, np.stack([y, np.ones_like(y)], axis=1))
    assert first[:, 0] == pytest.approx([0.3139, 0.4424, 0.0], abs=0.02)
    assert total[:, 0] == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.02)
    assert np.isnan(first[:, 1]).all()  # nothing varies


def test_rank_correlation_is_spearmans() -> None:
    rng = np.random.default_rng(1)
    x, noise = rng.random((2, 50, 2))
    y = x**3 + 0.3 * noise
    assert sensitivity.rank_correlation(x, y) == pytest.approx(stats.spearmanr(x, y).statistic[:2, 2:], abs=1e-12)


# -- running


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> tuple[sweep.SweepPlan, xr.Dataset, Path]:
    folder = tmp_path_factory.mktemp("sweep")
    actual = plan(folder)
    return actual, sweep.run_sweep(actual, folder / "mine.sqlite"), folder


def test_every_run_is_the_run_of_its_own(swept: tuple[sweep.SweepPlan, xr.Dataset, Path]) -> None:
    actual, data, _ = swept
    assert dict(data.sizes) == {"run": 8, "time": 4, "quantile": 5, "parameter": 2, "index3": 3}
    for k in (0, 7):
        alone = tca.run(tca.read("step", [*actual.overrides, *actual.run_overrides()[k]]))
        for name in actual.outputs:
            assert np.array_equal(data[name][k], alone[name])
    assert (data["failure"] == "").all()


def test_the_dataset_is_labelled_and_written_whole(swept: tuple[sweep.SweepPlan, xr.Dataset, Path]) -> None:
    _, data, folder = swept
    results.write(data, folder / "mine.nc")
    again = results.read(folder / "mine.nc")
    xr.testing.assert_identical(again, data)
    assert data["thermal.h"].dims == ("run",)
    assert data["thermal.h"].attrs["units"] == "W/(m2.K)"
    assert data["rod.tip.p"].dims == ("run", "time", "index3")
    assert data["rod.tip.p.quantile"].attrs["units"] == "m"
    assert np.array_equal(data["thermal.T.quantile"], np.quantile(data["thermal.T"], data["quantile"], axis=0))
    assert data["rod.tip.p.rank_correlation"][1, -1, 0] < -0.9  # a stiffer body bends less
    assert json.loads(data.attrs["design"])["seed"] == 1
    assert "numpy" in json.loads(data.attrs["versions"])
    assert json.loads(data.attrs["parameters"])["rod.body.E"] == {"lognorm": {"s": 0.1, "scale": 37800.0}}


def test_the_shipped_sweep_is_as_exact_as_it_says() -> None:
    """Its settings against those of scene `step`: rms over the run at most 1e-3 of an output's range."""
    actual = sweep.read_plan("scatter", runs=1)
    quick, exact = tca.run(actual.scene), tca.run("step", ["thermal.tolerance=1e-7", "rod.tolerance=1e-8"])
    for name in actual.outputs:
        reference = exact[name].sel(time=quick["time"], method="nearest").to_numpy()
        error = np.sqrt(np.mean((quick[name].to_numpy() - reference) ** 2))
        assert error < 1e-3 * np.ptp(reference), name


def test_the_shipped_sweep_runs_in_the_engine() -> None:
    plan = sweep.read_plan("scatter", runs=4)
    columns = {p.name: [row[k] for row in plan.values] for k, p in enumerate(plan.parameters)}
    runs = many_runs.EngineRuns.of(plan.scene, columns, plan.outputs)
    assert runs is not None
    ((numbers, rows, _),) = [zip(*block, strict=True) for block in runs.blocks(np.array(list(columns.values())).T)]
    assert numbers == (0, 1, 2, 3)
    alone = tca.run(plan.scene, {name: values[2] for name, values in columns.items()})
    for name, where in runs.plan.outputs.items():
        assert np.array_equal(rows[2][:, where], alone[name].to_numpy()), name


def test_the_figure_shows_every_output(swept: tuple[sweep.SweepPlan, xr.Dataset, Path]) -> None:
    _, data, folder = swept
    figure = chart.draw(data)
    assert [axes.get_ylabel() for axes in figure.axes[::2]] == ["thermal.T [°C]", "rod.tip.p [mm]"]
    assert [text.get_text() for text in figure.axes[2].get_legend().get_texts()] == ["x", "y", "z"]
    assert [label.get_text() for label in figure.axes[1].get_yticklabels()] == ["thermal.h", "rod.body.E"]
    for path in save_figure(figure, folder, "mine"):
        assert path.stat().st_size > 10_000


def test_failures_are_rows_with_their_message(tmp_path: Path) -> None:
    text = '[parameters]\n"rod.tca.offset, thermal.tca.offset" = ["2.5 mm", "4.9 mm"]\n'
    actual = sweep.run_sweep(plan(tmp_path, text, head="design = 'grid'\n"), tmp_path / "mine.sqlite")
    failure = actual["failure"].to_numpy()
    assert not failure[0]
    assert "thermal: " in failure[1]
    assert np.isfinite(actual["rod.tip.p"][0]).all()
    assert np.isnan(actual["rod.tip.p"][1]).all()
    assert np.isfinite(actual["rod.tip.p.quantile"]).all()
    assert "runs failed" in actual.attrs["status"]
    chart.draw(actual)


def test_saltelli_gives_both_orders(tmp_path: Path) -> None:
    actual = sweep.run_sweep(plan(tmp_path, head="design = 'saltelli'\nruns = 32\n"), tmp_path / "mine.sqlite")
    last = actual.isel(time=-1, index3=2)
    total = last["thermal.T.total_order"].to_numpy()
    assert total[0] > 0.5
    assert total[1] == 0.0  # a stiffer body heats nothing
    assert last["rod.tip.p.first_order"][1] > 0.5
    assert "Sobol' index" in chart.draw(actual).axes[1].get_xlabel()


def test_archives_stay_open_between_runs_until_their_file_changes(tmp_path: Path) -> None:
    path = Path(shutil.copy(find_fmu("rod.fmu"), tmp_path))
    archive = cached_archive(path)
    folder = archive.extract()
    archive.close()
    assert folder.is_dir()
    assert cached_archive(path) is archive
    os.utime(path, (0, 0))
    assert cached_archive(path) is not archive


# -- going on


def test_finished_runs_are_not_run_again(swept: tuple[sweep.SweepPlan, xr.Dataset, Path], tmp_path: Path) -> None:
    actual, data, _ = swept
    ran: list[int] = []

    def stopping(tasks: list) -> object:
        for number, outcome in serial(tasks):
            ran.append(number)
            yield number, outcome
            if len(ran) == 3:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep.run_sweep(actual, tmp_path / "mine.sqlite", stopping, threads=0)
    seen: list[sweep.SweepProgress] = []
    again = sweep.run_sweep(actual, tmp_path / "mine.sqlite", progress=seen.append)
    assert (seen[0], seen[-1]) == (sweep.SweepProgress(3, 0, 8), sweep.SweepProgress(3, 5, 8))
    xr.testing.assert_identical(again, data)
    more = plan(tmp_path, runs=16)  # a longer sequence begins with the same points
    sweep.run_sweep(more, tmp_path / "mine.sqlite", progress=seen.append)
    assert seen[-1] == sweep.SweepProgress(8, 8, 16)


def test_the_engine_and_the_master_give_the_same_bits(
    swept: tuple[sweep.SweepPlan, xr.Dataset, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    actual, data, _ = swept
    xr.testing.assert_identical(sweep.run_sweep(actual, tmp_path / "master.sqlite", threads=0), data)
    monkeypatch.setattr(many_runs, "FIRST_BLOCK", 3)
    monkeypatch.setattr(many_runs, "MOST_BLOCK", 3)
    seen: list[sweep.SweepProgress] = []
    blocks = sweep.run_sweep(actual, tmp_path / "blocks.sqlite", progress=seen.append, threads=2)
    xr.testing.assert_identical(blocks, data)
    assert [state.done for state in seen] == [0, 3, 6, 8]


def test_another_sweep_is_not_mixed_in(swept: tuple[sweep.SweepPlan, xr.Dataset, Path], tmp_path: Path) -> None:
    _, _, folder = swept
    other = plan(tmp_path, TWO.replace("0.1", "0.2"))
    with pytest.raises(CosimError, match="differs in parameters; remove it"):
        sweep.run_sweep(other, folder / "mine.sqlite")
    (tmp_path / "bad.sqlite").write_text("no database" * 100)
    with pytest.raises(CosimError, match="not a database; remove it"):
        sweep.run_sweep(other, tmp_path / "bad.sqlite")
