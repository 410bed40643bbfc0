"""Results: units and settings in the file, the same numbers back, never a half-written file."""

from __future__ import annotations

import csv
import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from tca_cosim import results
from tca_cosim.results.comparison import compare
from tca_cosim.results.dataset import describe_vector


@pytest.fixture(scope="module")
def result() -> xr.Dataset:
    return tca.run(tca.read("step", ["stop_time=1"]))


def test_variables_carry_units_and_meaning(result: xr.Dataset) -> None:
    assert result["thermal.T"].shape == (11, 3)
    assert result["rod.shape.p"].shape == (11, 21, 3)
    assert result["index21"].to_numpy().tolist() == list(range(1, 22))  # as in shape.p[21,3]
    units = {
        name: result[name].attrs["units"] for name in ("time", "thermal.V", "thermal.T", "rod.delta", "rod.tip.euler")
    }
    assert units == {"time": "s", "thermal.V": "V", "thermal.T": "K", "rod.delta": "m", "rod.tip.euler": "rad"}
    assert all(result[name].attrs["long_name"] for name in result.data_vars)


def test_the_log_is_part_of_it(result: xr.Dataset) -> None:
    assert result["coupling.step"][1:].to_numpy() == pytest.approx(np.full(10, 0.1))
    assert result["coupling.sweeps"][1:].min() >= 1
    assert (result["coupling.error"][1:] <= tca.Coupling().tolerance).all()
    assert result["coupling.gain"][-1] == pytest.approx(3.2, abs=0.1)


def test_settings_and_versions_are_part_of_it(result: xr.Dataset) -> None:
    members = json.loads(result.attrs["members"])
    assert members["rod"]["guid"]
    assert members["rod"]["parameters"]["closure"] == 2
    assert members["thermal"]["parameters"]["h"] == 20.0
    assert members["thermal"]["signals"]["V[3]"] == ["Constant", {"value": 3.0}]
    assert json.loads(result.attrs["coupling"])["method"] == "iqn"
    assert json.loads(result.attrs["versions"])["fmpy"]
    assert "thermal.T[2] -> rod.T[2]" in json.loads(result.attrs["connections"])
    assert result.attrs["status"] == "complete"


def test_netcdf_gives_the_same_back(result: xr.Dataset, tmp_path: Path) -> None:
    tca.write(result, tmp_path / "deep" / "step.nc")
    xr.testing.assert_identical(results.read(tmp_path / "deep" / "step.nc"), result)


def test_csv_gives_the_same_numbers_back(result: xr.Dataset, tmp_path: Path) -> None:
    path = tmp_path / "step.csv"
    tca.write(result, path)
    lines = [line for line in path.read_text().splitlines() if not line.startswith("# ")]
    rows = list(csv.reader(lines))
    assert rows[0][:2] == ["time [s]", "thermal.V[1] [V]"]
    table = np.array(rows[1:], dtype=float)
    column = rows[0].index("rod.delta[3] [m]")
    np.testing.assert_array_equal(table[:, column], result["rod.delta"].to_numpy()[:, 2])
    assert any(line.startswith("# versions: ") for line in path.read_text().splitlines())


def test_a_failed_write_leaves_the_old_file(
    result: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "step.csv"
    path.write_text("old")
    monkeypatch.setattr(np, "array_split", lambda *_, **__: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        tca.write(result, path)
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["step.csv"]


def test_unknown_endings_are_refused(result: xr.Dataset, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"\.csv, \.nc"):
        tca.write(result, tmp_path / "step.xlsx")


def test_a_run_that_fails_keeps_what_it_had() -> None:
    scene = tca.read("step", ["stop_time=1", "coupling.method=relaxed", "coupling.omega=0.5", "coupling.halvings=1"])
    with pytest.raises(tca.CouplingError) as caught:
        tca.run(scene)
    partial = caught.value.partial
    assert partial.attrs["status"].startswith("partial: coupling failed")
    assert 1 <= partial.sizes["time"] < 11
    assert np.isfinite(partial["rod.delta"]).all()


def rows(times: np.ndarray, values: np.ndarray, unit: str = "m") -> xr.Dataset:
    return xr.Dataset({"a.y": ("time", values, {"units": unit})}, {"time": times})


def test_comparison_takes_the_common_times() -> None:
    """Against a plain loop over all pairs of times."""
    rng = np.random.default_rng(4)
    for size in (1, 2, 7, 40):
        one = np.sort(rng.choice(60, size, replace=False)) * 0.1
        other = np.sort(rng.choice(60, size, replace=False)) * 0.1 * (1.0 + 1e-13)
        pairs = [(k, n) for k, a in enumerate(one) for n, b in enumerate(other) if abs(a - b) < 1e-9 * one[-1]]
        a, b = rows(one, rng.random(size)), rows(other, rng.random(size))
        if not pairs:
            with pytest.raises(ValueError, match="nothing to compare"):
                compare(a, b)
            continue
        gaps = np.array([a["a.y"].values[k] - b["a.y"].values[n] for k, n in pairs])
        [difference] = compare(a, b)
        assert difference.most == pytest.approx(np.abs(gaps).max())
        assert difference.rms == pytest.approx(np.sqrt((gaps**2).mean()))
        assert difference.time == one[pairs[int(np.abs(gaps).argmax())][0]]


def test_comparison_needs_memory_for_the_rows_alone() -> None:
    count = 100_000
    a, b = (rows(np.arange(count) * 1e-3, np.full(count, value)) for value in (1.0, 1.5))
    tracemalloc.start()
    [difference] = compare(a, b)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert difference.most == 0.5
    assert peak < 300 * count  # bytes; a matrix of all pairs of times has 80 GB


def test_angles_differ_modulo_a_turn() -> None:
    a, b = (rows(np.array([0.0]), np.array([value]), "rad") for value in (3.1, -3.1))
    assert compare(a, b)[0].most == pytest.approx(2 * np.pi - 6.2)


@pytest.mark.parametrize(
    ("texts", "combined"),
    [
        (["tip position, x", "tip position, y", "tip position, z"], "tip position, x, y, z"),
        (["gravity along x", "gravity along y", "gravity along z"], "gravity along x, y, z"),
        (["a of the tip", "b of the tip"], "a, b of the tip"),
        (["voltage"] * 3, "voltage"),
        (["mass", "stiffness"], "mass"),
        ([f"mode {k} of 9" for k in range(9)], "mode of 9"),
    ],
)
def test_the_description_of_a_vector_is_that_of_all_elements(texts: list[str], combined: str) -> None:
    assert describe_vector(texts) == combined


def test_long_names_of_vectors_name_no_single_element() -> None:
    computed = tca.run(tca.read("step", ["stop_time=0.2"]))
    assert computed["rod.tip.p"].attrs["long_name"] == "tip position, x, y, z"
    assert computed["rod.shape.p"].attrs["long_name"].endswith("x, y, z")
