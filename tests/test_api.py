"""The package from Python: scenes by name, path or value, overrides as tables, what notebooks show, types."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr

SHORT = {"stop_time": "1 s"}


@pytest.fixture(scope="module")
def result() -> xr.Dataset:
    return tca.run("step", SHORT)


def test_a_scene_runs_by_name_path_or_value(result: xr.Dataset, tmp_path: Path) -> None:
    path = tmp_path / "step.toml"
    path.write_text(tca.titles()["step"][1].read_text())
    for scene, overrides in (("step", ["stop_time=1"]), (path, SHORT), (tca.read("step", SHORT), ())):
        xr.testing.assert_equal(tca.run(scene, overrides), result)


def test_overrides_are_tables_of_python_values() -> None:
    volts = [0, {"steps": [["0 s", "1 V"], ["2 s", "0 V"]]}, 3.0]
    given = {"thermal.V": volts, "rod.dynamic": True, "coupling.method": "newton", "rod.body.E": np.float64(4e4)}
    scene = tca.read("step", given)
    assert scene.coupling.method == "newton"
    assert scene.member("rod").value("dynamic") is True
    assert scene.member("rod").value("body.E") == 4e4
    assert scene.member("thermal").signals["V[2]"].breaks == (2.0,)
    assert tca.read("step", {"thermal.V": np.zeros(3)}).member("thermal").signals["V[3]"].polynomial(0.0, 1.0)[0] == 0.0


@pytest.mark.parametrize(
    ("overrides", "text"),
    [
        ({"rod.order": object()}, "rod.order = <object.*object is not a number"),
        ("rod.order=2", r"\['rod.order=2'\]"),
        ({"rod.ordr": 2}, "did you mean 'order'"),
        ({"rod.body.E": float("nan")}, "rod.body.E"),
    ],
)
def test_overrides_that_mean_nothing_are_refused(overrides: tca.Overrides, text: str) -> None:
    with pytest.raises(tca.SceneError, match=text):
        tca.read("step", overrides)


def test_a_scene_that_is_read_takes_further_overrides(result: xr.Dataset) -> None:
    """They win over those it was read with."""
    scene = tca.read("step", {"stop_time": "2 s", "rod.order": 3})
    again = tca.read(scene, {"stop_time": "1 s", "rod.order": 4})
    assert (again.stop_time, again.member("rod").value("order")) == (1.0, 4)
    assert again.title == "Step: V = (0, 1.5, 3) V (modified: stop_time=2 s, rod.order=3, stop_time=1 s, and 1 more)"
    xr.testing.assert_equal(tca.run(tca.read("step"), SHORT), result)


def test_a_table_describes_a_whole_scene(result: xr.Dataset) -> None:
    rod = {"closure": "exchanged", "dynamic": False, "body": {"retardation": "5 ms"}}
    table = {"stop_time": "1 s", "thermal": {"V": [0, 1.5, 3]}, "rod": rod, "name": "mine"}
    xr.testing.assert_equal(tca.run(table), result)
    assert tca.read(table).name == "mine"
    with pytest.raises(tca.SceneError, match=r"scene: rod\.ordr = 2: no such variable .*; did you mean 'order'"):
        tca.read({**table, "rod": {"ordr": 2}})
    with pytest.raises(tca.SceneError, match="scene 3: int; give the name of a scene, a file, or a table"):
        tca.read(3)  # type: ignore[arg-type]


def test_inputs_are_functions_arrays_or_frames_over_time() -> None:
    pd = pytest.importorskip("pandas")
    times = np.array([0.0, 5.0, 10.0])
    ramp = tca.read("step", {"thermal.V[1]": {"ramps": [[0, 0], [5, 1], [10, 0]]}}).member("thermal").signals["V[1]"]
    frame = pd.DataFrame({"a": [0.0, 1.0, 0.0], "b": 0.0, "c": 3.0}, index=times)
    for value in (
        {"thermal.V[1]": np.column_stack([times, [0.0, 1.0, 0.0]])},
        {"thermal.V[1]": frame["a"]},
        {"thermal.V": frame},
        {"thermal.V": np.column_stack([times, frame.to_numpy()])},
        {"thermal.V[1]": ramp},
    ):
        assert tca.read("step", value).member("thermal").signals["V[1]"] == ramp
    scene = tca.read("step", {"thermal.V": lambda t: [0.0, 0.1 * t, 3.0], "stop_time": 1.05})
    signal = scene.member("thermal").signals["V[2]"]
    assert signal.breaks == pytest.approx([*np.arange(0.0, 1.05, 0.1), 1.05])
    assert signal.polynomial(0.4, 0.1)[:2] == pytest.approx((0.04, 0.1))
    for said, value in {
        "does not return numbers": lambda t: "much",
        "times must increase": np.array([[1.0, 0.0], [0.0, 1.0]]),
    }.items():
        with pytest.raises(tca.SceneError, match=said):
            tca.read("step", {"thermal.V[1]": value})


def test_a_scene_says_what_it_is() -> None:
    scene = tca.read("switch", {"rod.order": 2})
    lines = repr(scene).splitlines()
    assert lines[0] == "Scene 'switch': Switch: V1 = 3 V until 15 s, then V2 = 3 V (modified: rod.order=2)"
    assert any("30 s in macro steps of 0.1 s" in line for line in lines)
    assert any("rod.fmu" in line and "order 2" in line and "closure exchanged" in line for line in lines)
    assert any("V[1] = steps(times [0, 15], values [3, 0]) V" in line for line in lines)
    assert any("V[3] = 0 V" in line for line in lines)
    shown = scene._repr_html_()
    assert shown.startswith("<table>")
    assert "thermal.T -&gt; rod.T, rod.delta -&gt; rod.delta_guess" in shown


def test_results_draw_themselves(result: xr.Dataset, tmp_path: Path) -> None:
    figure = result.tca.plot()
    titles = [axes.get_title(loc="left") for axes in figure.axes if axes.get_visible()]
    assert {"Temperatures [°C]", "Energies of the rod [mJ]", "Sweeps per macro step"} <= set(titles)
    assert figure._repr_png_().startswith(b"\x89PNG")
    film = result.tca.animate(frames=3)
    assert film.data.startswith(b"GIF89a")
    assert film._repr_html_().startswith('<img alt="animation of the manipulator" src="data:image/gif;base64,')
    assert "MB" in repr(film)
    assert result.tca.animate(tmp_path / "a.gif", frames=2) == tmp_path / "a.gif"
    assert result.tca.report(tmp_path / "a.html") == tmp_path / "a.html"
    assert {file.name for file in tmp_path.iterdir()} == {"a.gif", "a.html"}


def test_reports_need_their_extra(result: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "tca_cosim.visualization.report.page", None)
    monkeypatch.delattr("tca_cosim.visualization.report.page", raising=False)
    with pytest.raises(tca.CosimError, match=r"tca-cosim\[report\]"):
        result.tca.report(tmp_path / "a.html")


def test_the_package_is_typed(tmp_path: Path) -> None:
    (tmp_path / "user.py").write_text(
        "from pathlib import Path\n"
        "import xarray as xr\n"
        "from typing_extensions import assert_type\n"
        "import tca_cosim as tca\n"
        "scene = tca.read('step', {'rod.order': 2})\n"
        "assert_type(scene, tca.Scene)\n"
        "assert_type(scene.coupling.macro_step, float)\n"
        "assert_type(tca.run(scene), xr.Dataset)\n"
        "assert_type(tca.run('step', ['rod.order=2']), xr.Dataset)\n"
        "assert_type(tca.write(tca.run('step'), Path('a.nc')), None)\n"
        "tca.run(3)  # type: ignore[arg-type]\n"
    )
    checked = [
        "--strict",
        "--warn-unused-ignores",
        "--follow-imports=silent",
        "--no-incremental",
        str(tmp_path / "user.py"),
    ]
    done = subprocess.run([sys.executable, "-m", "mypy", *checked], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_a_table_of_a_whole_scene_takes_arrays_and_functions() -> None:
    table = {"stop_time": 0.2, "thermal": {"V": np.array([0.0, 1.0, 2.0])}, "rod": {"dynamic": False}}
    assert tca.run(table)["thermal.V"].values[-1] == pytest.approx([0.0, 1.0, 2.0])
    moving = {**table, "thermal": {"V": lambda t: [t, 0.0, 5.0 * t]}}
    assert tca.run(moving)["thermal.V"].values[-1] == pytest.approx([0.2, 0.0, 1.0])
    assert tca.run(moving, {"thermal.V": [1, 1, 1]})["thermal.V"].values[-1] == pytest.approx([1.0, 1.0, 1.0])
