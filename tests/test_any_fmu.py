"""Scenes of small foreign FMUs: names, vectors, types, values, ends, warnings, copies of libraries, encodings."""

from __future__ import annotations

import codecs
import csv
import json
import os
import re
import subprocess
import sys
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from fmu_maker import boolean, enumeration, integer, make_fmu, real, string
from tca_cosim import results
from tca_cosim.cli import app
from tca_cosim.errors import FmuWarning
from tca_cosim.fmi.archive import Archive, cached_archive
from tca_cosim.scene import read
from tca_cosim.verification import reference
from tca_cosim.verification.monolith.integration import solve_monolith
from typer.testing import CliRunner

HELD = {"exchange": "held", "waveform": "held"}
COUNTER = {
    "variables": [integer("n"), boolean("odd"), string("label"), integer("hidden", "local")],
    "step": 'integer[0]++; boolean[0] = integer[0] % 2; snprintf(string[0], TEXT, "step %d", integer[0]);',
    "output": "integer[1] = 10 * integer[0];",
}
USER = {
    "variables": [
        integer("n", "input", start=0),
        boolean("on", "input", start="false"),
        string("text", "input", start=""),
        real("y"),
        real("letters"),
    ],
    "output": "real[0] = integer[0] + 1000 * boolean[0]; real[1] = strlen(string[0]);",
}
GEAR = (
    '<SimpleType name="Gear"><Enumeration><Item name="reverse" value="-1"/><Item name="neutral" value="0"/>'
    '<Item name="first" value="1"/></Enumeration></SimpleType>'
)
MODE = (
    '<SimpleType name="Mode"><Enumeration><Item name="off" value="10"/><Item name="eco" value="20"/></Enumeration>'
    "</SimpleType>"
)


@pytest.fixture
def make(tmp_path: Path) -> Callable[..., str]:
    """Makes an FMU of that name; returns the name of its file."""

    def fmu(name: str, variables: list, **more: Any) -> str:
        return make_fmu(tmp_path / f"{name}.fmu", variables, **more).name

    return fmu


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tca.Scene]:
    """Reads a scene of FMUs in the folder of the test."""
    monkeypatch.chdir(tmp_path)

    def read(fmus: dict[str, str], *connections: str, stop: float = 1.0, step: float = 0.25, **more: Any) -> tca.Scene:
        coupling = {"macro_step": step, **HELD, **more.pop("coupling", {})}
        table = {"stop_time": stop, "connections": list(connections), "fmus": fmus, "coupling": coupling, **more}
        return tca.read(table)

    return read


def saved(result: xr.Dataset, folder: Path) -> tuple[xr.Dataset, list[str]]:
    """The result from its NetCDF file, and the names of the columns of its CSV file."""
    for ending in ("nc", "csv"):
        tca.write(result, folder / f"out.{ending}")
    lines = (folder / "out.csv").read_text(encoding="utf-8").splitlines()
    header = next(line for line in lines if not line.startswith("#"))
    return results.read(folder / "out.nc"), next(csv.reader([header]))


# -- names and vectors -------------------------------------------------------------------------------------------------


def test_indices_from_zero(make: Callable, scene: Callable, tmp_path: Path) -> None:
    a = make(
        "a", [real(f"y[{k}]") for k in range(3)], output="for (int k = 0; k < 3; k++) real[k] = 10.0 * (k + 1) + t;"
    )
    result = tca.run(scene({"a": a, "b": make("b", [real("y[0]")], output="real[0] = 7.0;")}))
    assert result["a.y"].values[-1].tolist() == [11.0, 21.0, 31.0]
    assert result["a.y"].coords["index3_from0"].values.tolist() == [0, 1, 2]
    assert result["b.y"].values[-1].tolist() == [7.0]
    again, columns = saved(result, tmp_path)
    xr.testing.assert_identical(again, result)
    assert [f"a.y[{k}] [1]" for k in range(3)] == columns[1:4]


def test_elements_go_by_index_whatever_their_order(make: Callable, scene: Callable) -> None:
    """The XML lists them as texts sort: [1], [10], [11], [12], [2], ..."""
    names = sorted(range(1, 13), key=str)
    source = make(
        "s", [real(f"y[{k}]", reference=k) for k in names], output="for (int k = 1; k < 13; k++) real[k] = k;"
    )
    inputs = [real(f"u[{k}]", "input", start=0.0) for k in range(1, 13)]
    target = make("d", [*inputs, real("third")], output="real[12] = real[2];")
    values = make(
        "p", [*(real(f"p[{k}]", "parameter", start=0.0, reference=k) for k in names), real("q", reference=20)],
        output="real[20] = real[3];",
    )  # fmt: skip
    table = {"p": list(range(1, 13))}
    result = tca.run(scene({"s": source, "d": target, "p": values}, "s.y -> d.u", p=table))
    assert result["s.y"].values[-1].tolist() == list(range(1, 13))
    assert result["d.u"].values[-1].tolist() == list(range(1, 13))
    assert result["d.third"][-1] == 3.0
    assert result["p.q"][-1] == 3.0


def test_vectors_of_other_origin_correspond_and_others_do_not(make: Callable, scene: Callable) -> None:
    source = make("s", [real("y[0]"), real("y[1]")], output="real[0] = 5.0; real[1] = 6.0;")
    target = make("d", [real("u[1]", "input", start=0.0), real("u[2]", "input", start=0.0)])
    gaps = make("g", [real("u[1]", "input", start=0.0), real("u[3]", "input", start=0.0)])
    assert tca.run(scene({"s": source, "d": target}, "s.y -> d.u"))["d.u"].values[-1].tolist() == [5.0, 6.0]
    with pytest.raises(tca.SceneError, match=r"the indices of 's.y' and 'g.u' differ; connect the elements one by one"):
        scene({"s": source, "g": gaps}, "s.y -> g.u")
    with pytest.raises(tca.SceneError, match=r"its indices have gaps: u\[1\], u\[3\].*one by one"):
        scene({"g": gaps}, g={"u": [1.0, 2.0]})
    result = tca.run(scene({"g": gaps}, g={"u": 4.0}))
    assert (result["g.u[1]"] == 4.0).all()
    assert (result["g.u[3]"] == 4.0).all()


def test_matrices_are_set_by_rows(make: Callable, scene: Callable) -> None:
    names = [(2, 3), (1, 1), (1, 2), (2, 1), (1, 3), (2, 2)]
    parameters = [real(f"M[{i},{j}]", "parameter", start=0.0, reference=3 * i + j) for i, j in names]
    outputs = [real(f"N[{i},{j}]", reference=20 + 3 * i + j) for i, j in names]
    fmu = make("m", [*parameters, *outputs], output="for (int k = 0; k < 10; k++) real[20 + k] = real[k];")
    for given in ([[1, 2, 3], [4, 5, 6]], [1, 2, 3, 4, 5, 6]):
        result = tca.run(scene({"m": fmu}, m={"M": given}))
        assert result["m.N"].values[-1].tolist() == [[1, 2, 3], [4, 5, 6]]
    with pytest.raises(tca.SceneError, match=r"M.*another shape; give lists of 2 lists of 3 elements"):
        scene({"m": fmu}, m={"M": [[1, 2], [3, 4], [5, 6]]})


def test_scalars_beside_vectors_of_one_name(make: Callable, scene: Callable, tmp_path: Path) -> None:
    a = make("a", [real("T"), real("T[1]"), real("T[2]")], output="real[0] = 100; real[1] = 1; real[2] = 2;")
    b = make("b", [real("T[1]"), real("T[1,1]"), real("T[1,2]")], output="real[0] = 1; real[1] = 11; real[2] = 12;")
    result = tca.run(scene({"a": a, "b": b}))
    expected = {"a.T": 100, "a.T[1]": 1, "a.T[2]": 2, "b.T[1]": 1, "b.T[1,1]": 11, "b.T[1,2]": 12}
    assert {name: float(result[name][-1]) for name in expected} == expected
    again, columns = saved(result, tmp_path)
    xr.testing.assert_identical(again, result)
    assert len(columns) == len(set(columns))


NAMES = [
    "dy/dt",
    "speed [km/h]",
    "P/Q",
    'a "quoted" one',
    "größe 測試",
    "a -> b",
    "tail ",
    "x" * 300,
    "100%",
    "a,b;c",
    "'",
]


def test_names_of_any_characters(make: Callable, scene: Callable, tmp_path: Path) -> None:
    outputs = [real(name) for name in NAMES]
    source = make("s", outputs, output=f"for (int k = 0; k < {len(NAMES)}; k++) real[k] = k + t;")
    target = make("d", [real(name, "input", start=0.0) for name in NAMES])
    wires = [{"from": f"s.{name}", "to": f"d.{name}"} for name in NAMES]
    result = tca.run(scene({"s": source, "d": target}, *wires))
    for k, name in enumerate(NAMES):
        assert result[f"s.{name}"][-1] == k + 1.0
        assert result[f"d.{name}"][-1] == k + 1.0
    again, _ = saved(result, tmp_path)
    assert list(again.data_vars) == list(result.data_vars)
    xr.testing.assert_identical(again, result)


# -- types -------------------------------------------------------------------------------------------------------------


def test_outputs_of_all_types_are_in_the_result(make: Callable, scene: Callable, tmp_path: Path) -> None:
    result = tca.run(scene({"c": make("c", **COUNTER)}, record=["c.hidden"]))
    assert result["c.n"].values.tolist() == [0, 1, 2, 3, 4]
    assert result["c.odd"].values.tolist() == [False, True, False, True, False]
    assert result["c.label"].values.tolist() == ["", "step 1", "step 2", "step 3", "step 4"]
    assert result["c.hidden"].values.tolist() == [0, 10, 20, 30, 40]
    assert [result[f"c.{name}"].dtype.kind for name in ("n", "odd", "label")] == ["i", "b", "O"]
    again, columns = saved(result, tmp_path)
    xr.testing.assert_equal(again, result)
    rows = [line for line in (tmp_path / "out.csv").read_text().splitlines() if not line.startswith("#")]
    assert rows[-1].startswith("1,4,0,step 4,40,")
    assert "c.label [1]" in columns


def test_like_types_are_wired_and_held(make: Callable, scene: Callable) -> None:
    fmus = {"c": make("c", **COUNTER), "u": make("u", **USER)}
    wires = ("c.n -> u.n", "c.odd -> u.on", "c.label -> u.text")
    for exchange in ("held", "linear", "hermite"):  # discrete values are held, whatever the others do
        result = tca.run(scene(fmus, *wires, coupling={"exchange": exchange, "waveform": exchange}))
        assert result["u.y"].values[1:].tolist() == [1001.0, 2.0, 1003.0, 4.0]
        assert result["u.letters"].values[1:].tolist() == [6.0] * 4
    with pytest.raises(tca.SceneError, match="types differ: Integer and Boolean"):
        scene(fmus, "c.n -> u.on")


def test_discrete_values_in_a_loop_are_those_of_the_steps_start(make: Callable, scene: Callable) -> None:
    """A counter that resets itself through another FMU: the reset comes a step later, with and without a Real loop."""
    count = [integer("reset", "input", start=0), integer("n"), real("u", "input", start=0.0), real("y")]
    a = make("a", count, step="integer[1] = integer[0] ? 0 : integer[1] + 1;", output="real[1] = 0.5 * real[0] + 1.0;")
    check = [integer("n", "input", start=0), integer("reset"), real("u", "input", start=0.0), real("y")]
    b = make("b", check, output="integer[1] = integer[0] >= 3; real[1] = -4.0 * real[0];")
    discrete = ("a.n -> b.n", "b.reset -> a.reset")
    for wires in (discrete, (*discrete, "a.y -> b.u", "b.y -> a.u")):
        result = tca.run(scene({"a": a, "b": b}, *wires, stop=2.0))
        assert result["a.n"].values.tolist() == [0, 1, 2, 3, 0, 1, 2, 3, 0]
    np.testing.assert_allclose(result["a.y"][1:], 1.0 / 3.0, atol=1e-6)


def test_signals_for_inputs_of_other_types(make: Callable, scene: Callable) -> None:
    table = {"n": {"steps": [[0, 0], [0.5, 5]]}, "on": {"steps": [[0, False], [0.5, True]]}, "text": "four"}
    result = tca.run(scene({"u": make("u", **USER)}, u=table))
    assert result["u.y"].values[[1, 3, 4]].tolist() == [0.0, 1005.0, 1005.0]
    assert result["u.letters"].values[1:].tolist() == [4.0] * 4
    with pytest.raises(tca.SceneError, match=r"u.n .*Integer.*steps"):
        scene({"u": make("u", **USER)}, u={"n": {"ramps": [[0, 0], [1, 5]]}})


def test_discrete_reals_hold_what_drives_them(make: Callable, scene: Callable) -> None:
    variables = [
        real("u", "input", start=0.0, variability="discrete"),
        real("v", "input", start=0.0),
        real("y"),
        real("z"),
    ]
    fmu = make(
        "d", variables, step="real[2] = real[0]; real[3] = slope[0][1];", co_simulation={"canInterpolateInputs": "true"}
    )
    result = tca.run(scene({"d": fmu}, d={"u": {"ramps": [[0, 0], [1, 1]]}, "v": 1.0}))
    assert result["d.y"].values[1:].tolist() == [0.0, 0.25, 0.5, 0.75]
    assert not result["d.z"].values.any()


def test_enumerations_have_the_values_of_the_xml(make: Callable, scene: Callable) -> None:
    variables = [
        enumeration("gear", "parameter", variability="tunable", declaredType="Gear", start=0),
        enumeration("mode", "parameter", variability="tunable", declaredType="Mode", start=10),
        enumeration("next", declaredType="Gear"),
        real("g"),
        real("m"),
    ]
    fmu = make("e", variables, types=GEAR + MODE, output="real[0] = integer[0]; real[1] = integer[1]; integer[2] = -1;")
    cases = [({"gear": "reverse", "mode": "eco"}, (-1, 20)), ({}, (0, 10)), ({"gear": 1, "mode": 20}, (1, 20))]
    for given, expected in cases:
        result = tca.run(scene({"e": fmu}, e=given))
        assert (result["e.g"][-1], result["e.m"][-1]) == expected
    assert json.loads(result.attrs["members"])["e"]["choices"] == {"gear": "first", "mode": "eco"}
    assert result["e.next"].values.tolist() == [-1] * 5
    assert result["e.next"].attrs["flag_meanings"] == "reverse neutral first"
    for wrong in (2, "third", 10):
        with pytest.raises(tca.SceneError, match=r"e.gear"):
            scene({"e": fmu}, e={"gear": wrong})


@pytest.mark.parametrize(
    ("variable", "problem"),
    [
        (real("p", "parameter", start="1,5"), r"'p' \(line 4.*start = '1,5'"),
        (real("p", "parameter", start=1, nominal="auto"), "nominal = 'auto'"),
        (real("p", "parameter", start=""), "start = ''"),
        (integer("p", "parameter", start="1.5"), "start = '1.5'"),
        (integer("p", "parameter", start="3000000000"), "start = '3000000000'"),
        (boolean("p", "parameter", start="yes"), "start = 'yes'"),
        (real("p", "parameter", start=1, reference=-1), "valueReference = '-1' is out of range"),
    ],
)
def test_values_that_cannot_be_read_are_named(make: Callable, tmp_path: Path, variable: Any, problem: str) -> None:
    make("w", [variable, real("y", reference=0)], cs=True, platform="")
    with pytest.raises(tca.SceneError, match=rf"w.fmu: .*{problem}"):
        Archive(tmp_path / "w.fmu")


def test_values_in_the_writing_of_some_exporters(make: Callable, scene: Callable) -> None:
    variables = [integer("n", "parameter", start="4.0"), boolean("on", "parameter", start="True"), real("y")]
    fmu = make("w", variables, output="real[0] = integer[0] + boolean[0];")
    assert tca.run(scene({"w": fmu}))["w.y"][-1] == 5.0


def test_differences_take_no_offset(make: Callable, scene: Callable) -> None:
    units = '<Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit><Unit name="K"><BaseUnit K="1"/></Unit>'
    variables = [
        real("dT", "parameter", start=1.0, unit="degC", relativeQuantity="true"),
        real("T", "parameter", start=20.0, unit="degC"),
        real("dK", "parameter", start=1.0, unit="K", relativeQuantity="true"),
    ]
    fmu = make(
        "r",
        [*variables, real("a"), real("b"), real("c")],
        units=units,
        output="for (int k = 0; k < 3; k++) real[3 + k] = real[k];",
    )
    result = tca.run(scene({"r": fmu}, r={"dT": "5 K", "T": "300 K", "dK": "5 degC"}))
    np.testing.assert_allclose([result[f"r.{name}"][-1] for name in "abc"], [5.0, 26.85, 5.0])


# -- start, end, warnings ----------------------------------------------------------------------------------------------

ENDING = """
if (t + h > {end} + 1e-9) {{
  m->reached = {reached};
  m->terminated = 1;
  LOG(fmi2Discard, "the model ends");
  return fmi2Discard;
}}
real[0] = t + h;
"""


@pytest.mark.parametrize("state", [True, False])
@pytest.mark.parametrize("end", [0.45, 0.5, 0.01])
def test_an_fmu_may_end_the_simulation(make: Callable, scene: Callable, state: bool, end: float) -> None:
    """Where it could go no further it says when it ended: within a step, at its begin, in the first one."""
    fmu = make(
        "a", [real("y"), real("t")], step=ENDING.format(end=end, reached=end), output="real[1] = t;", state=state
    )
    result = tca.run(scene({"a": fmu}, step=0.1))
    assert result.attrs["status"] == "complete"
    assert float(result["time"][-1]) == pytest.approx(end, abs=1e-12)
    assert f"a ended the simulation at t = {end:g} s: the model ends" in result.attrs["ended"]
    inner = np.arange(0.0, end, 0.1)
    np.testing.assert_allclose(result["time"][: inner.size], inner, atol=1e-12)


def test_an_fmu_may_end_at_the_end_of_a_step(make: Callable, scene: Callable) -> None:
    end = "m->reached = t + h; m->time = t + h; m->terminated = 1; return fmi2Discard;"
    step = f"real[0] = t + h; if (t + h > 0.45) {{ {end} }}"
    result = tca.run(scene({"a": make("a", [real("y")], step=step)}, step=0.1))
    assert result.attrs["status"] == "complete"
    assert result["a.y"].values[-1] == pytest.approx(0.5)
    assert "a ended the simulation at t = 0.5 s" in result.attrs["ended"]


@pytest.mark.parametrize("state", [True, False])
def test_the_other_fmus_end_at_the_same_time(make: Callable, scene: Callable, state: bool) -> None:
    other = make("b", [real("u", "input", start=0.0), real("y")], output="real[1] = t;", state=state)
    fmu = make("a", [real("y")], step=ENDING.format(end=0.45, reached=0.45), state=state)
    result = tca.run(scene({"b": other, "a": fmu}, "a.y -> b.u", step=0.1))
    assert result.attrs["status"] == "complete"
    assert float(result["time"][-1]) == pytest.approx(0.45 if state else 0.4)
    assert result["b.y"][-1] == result["time"][-1]


def test_start_time_stop_time_and_tolerance_are_handed_over(make: Callable, scene: Callable) -> None:
    output = "real[0] = m->start_time; real[1] = m->stop_time; real[2] = m->tolerance; real[3] = t;"
    fmu = make("e", [real("a"), real("b"), real("c"), real("now")], output=output)
    result = tca.run(scene({"e": fmu}, stop=3.0, start_time=2.0, tolerance=1e-5))
    assert [float(result[f"e.{name}"][0]) for name in "abc"] == [2.0, 3.0, 1e-5]
    assert result["time"].values.tolist() == [2.0, 2.25, 2.5, 2.75, 3.0]
    assert result["e.now"].values.tolist() == result["time"].values.tolist()
    for solve in (solve_monolith, reference.run):
        with pytest.raises(tca.SceneError, match=r"start_time = 0.5 s: the (monolith|reference) starts at 0 s; remove"):
            solve(tca.read("step", {"stop_time": 1.0, "start_time": 0.5}))
    with pytest.raises(tca.SceneError, match=r"start_time = 4.0: not before the stop time, 3 s"):
        scene({"e": fmu}, stop=3.0, start_time=4.0)


def test_warnings_are_shown_once_each(make: Callable, scene: Callable) -> None:
    step = 'LOG(fmi2Warning, "tolerance not reached in step %d", m->steps); return fmi2Warning;'
    with pytest.warns(FmuWarning, match=r"w: tolerance not reached in step 0 \(at t = 0 s, 4 times in all\)") as caught:
        result = tca.run(scene({"w": make("w", [real("y")], step=step)}))
    assert len(caught) == 1
    [warning] = json.loads(result.attrs["warnings"])
    assert (warning["member"], warning["count"], warning["time"]) == ("w", 4, 0.0)


def test_the_command_line_shows_warnings_and_who_ended_the_run(
    make: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    step = 'LOG(fmi2Warning, "careful in step %d", m->steps); ' + ENDING.format(end=0.45, reached=0.45)
    make("w", [real("y")], step=step)
    (tmp_path / "s.toml").write_text("stop_time = 1\nconnections = []\n[fmus]\nw = 'w.fmu'\n")
    shown = CliRunner().invoke(app, ["run", "s.toml"]).output
    assert shown.count("warning: ") == 1
    assert re.search(r"warning: w: careful in step 0 \(at t = 0 s, \d+ times in all\)", shown)
    assert "w ended the simulation at t = 0.45 s: careful in step 5; the model ends" in shown


@pytest.mark.slow
@pytest.mark.parametrize(
    "locale", [{"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, {"PYTHONIOENCODING": "ascii"}]
)
def test_files_of_any_name_in_any_locale(make: Callable, tmp_path: Path, locale: dict[str, str]) -> None:
    make("mödel", [real("y")], output="real[0] = t;")
    text = 'title = "Täst"\nstop_time = 1\nconnections = []\n[fmus]\na = "mödel.fmu"\n'
    (tmp_path / "scène.toml").write_text(text, encoding="utf-8")
    command = [sys.executable, "-c", "from tca_cosim.cli import app; app()", "run", "scène.toml", "--out", "rés ült"]
    done = subprocess.run(command, cwd=tmp_path, env={**os.environ, **locale}, capture_output=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert results.read(tmp_path / "rés ült" / "scène.nc")["a.y"][-1] == 1.0


def test_results_that_are_not_finite_are_named(make: Callable, scene: Callable) -> None:
    fmu = make("n", [real("y"), real("z")], output="real[1] = t > 0.3 ? 0.0 / 0.0 : 1.0;")
    with pytest.warns(FmuWarning, match=r"a: z is -?nan \(at t = 0.5 s, 3 times in all\)"):
        tca.run(scene({"a": fmu}))
    other = make("d", [real("u", "input", start=0.0)])
    with pytest.raises(tca.CouplingError, match=r"a: output z is -?nan at t = 0.\d+ s"):
        tca.run(scene({"a": fmu, "d": other}, "a.z -> d.u"))


def test_a_run_without_warnings_is_silent(make: Callable, scene: Callable, capfd: pytest.CaptureFixture[str]) -> None:
    step = 'm->callbacks->logger(m->callbacks->componentEnvironment, NULL, fmi2OK, NULL, "all is well");'
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = tca.run(scene({"w": make("w", [real("y")], step=step)}))
    assert result.attrs["warnings"] == "[]"
    assert capfd.readouterr() == ("", "")


def test_errors_carry_all_lines_of_the_message(make: Callable, scene: Callable) -> None:
    step = 'if (t > 0.4) { LOG(fmi2Error, "first line\\nsecond line, 50%% done, value %g\\n", t); return fmi2Error; }'
    with pytest.raises(tca.CouplingError, match=r"(?s)first line.*second line, 50% done, value 0.5") as caught:
        tca.run(scene({"w": make("w", [real("y")], step=step)}, coupling={"halvings": 1}))
    assert caught.value.partial.sizes["time"] >= 3


# -- instances ---------------------------------------------------------------------------------------------------------

GLOBAL = "static double shared; static int instances;"
ONCE = {"canBeInstantiatedOnlyOncePerProcess": "true"}


@pytest.mark.parametrize("archive", [Archive, cached_archive])
@pytest.mark.parametrize("declared", [{}, ONCE])
def test_two_of_one_fmu_share_no_globals(
    make: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, archive: Any, declared: dict[str, str]
) -> None:
    """Also in many runs of one process, whose archives stay extracted; the library refuses a second instance."""
    refuse = 'if (instances++) { LOG(fmi2Error, "one instance per process"); free(m); return NULL; }'
    fmu = make(
        "g", [real("k", "parameter", start=1.0), real("y")], head=GLOBAL, enter="shared = real[0];",
        output="real[1] = shared;", instantiate=refuse, co_simulation=declared,
    )  # fmt: skip
    monkeypatch.chdir(tmp_path)
    for first in (3.0, 4.0):
        table = {"stop_time": 1.0, "connections": [], "fmus": {"a": fmu, "b": fmu}, "a": {"k": first}, "b": {"k": 5.0}}
        result = tca.run(read(table, archive=archive))
        assert (result["a.y"][-1], result["b.y"][-1]) == (first, 5.0)


def test_one_instance_per_process_means_another_process(make: Callable, scene: Callable) -> None:
    """All that a run needs goes through to it: values of all types, a loop with rollback, warnings, the end."""
    step = """
    real[2] = getpid();
    integer[1] = integer[0] + 1;
    snprintf(string[1], TEXT, "<%s>", string[0]);
    LOG(fmi2Warning, "careful");
    if (real[4] > 0 && t + h > 0.6) { m->reached = 0.6; m->terminated = 1; return fmi2Discard; }
    """
    numbers = [real("u", "input", start=0.0), real("y"), real("process"), real("k", "parameter", start=1.0)]
    numbers.append(real("last", "parameter", start=0.0))
    others = [integer("n", "input", start=0), integer("more"), string("text", "input", start="none"), string("shown")]
    fmu = make(
        "p", [*numbers, *others], head="#include <unistd.h>", step=step, output="real[1] = real[3] * real[0] + 1.0;",
        co_simulation=ONCE,
    )  # fmt: skip
    wires = ("a.y -> b.u", "b.y -> a.u", "a.more -> b.n", "a.shown -> b.text")
    with pytest.warns(FmuWarning, match="careful") as caught:
        result = tca.run(scene({"a": fmu, "b": fmu}, *wires, a={"k": 2.0}, b={"k": -3.0, "last": 1.0}))
    assert result["a.process"][-1] != result["b.process"][-1]
    np.testing.assert_allclose(result["a.y"][1:], 3.0 / 7.0, atol=1e-6)  # y = 2 (1 - 3 y) + 1
    assert result["b.more"].values[-1] == 2
    assert result["b.shown"].values[-1] == "<<none>>"
    assert float(result["time"][-1]) == pytest.approx(0.6)
    assert len(caught) == 2


def test_a_process_that_dies_is_an_error(make: Callable, scene: Callable) -> None:
    fmu = make(
        "p", [real("y"), real("k", "parameter", start=0.0)], step="if (real[1] > 0) abort();", co_simulation=ONCE
    )
    with pytest.raises(tca.CosimError, match=r"b: its process ended \(exit code -6\)"):
        tca.run(scene({"a": fmu, "b": fmu}, b={"k": 1.0}))


# -- files -------------------------------------------------------------------------------------------------------------


def rewritten(path: Path, target: str, change: Callable[[str, bytes], tuple[str, bytes] | None]) -> str:
    """A copy of an archive whose files went through `change`."""
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(path.with_name(target), "w") as sink:
        for name in source.namelist():
            changed = change(name, source.read(name))
            if changed is not None:
                entry = zipfile.ZipInfo("x")
                entry.filename = changed[0]
                sink.writestr(entry, changed[1])
    return target


XML = "modelDescription.xml"


def in_encoding(name: str, content: bytes, encoding: str) -> tuple[str, bytes]:
    text = content.decode().replace("UTF-8", encoding).replace('generationTool="fmu_maker"', 'generationTool="Größe"')
    return name, text.encode(encoding) if name == XML else content


READABLE: dict[str, Callable[[str, bytes], tuple[str, bytes] | None]] = {
    "backslashes": lambda name, content: (name.replace("/", "\\"), content),
    "byte-order mark": lambda name, content: (name, codecs.BOM_UTF8 + content if name == XML else content),
    "ISO-8859-1": lambda name, content: in_encoding(name, content, "ISO-8859-1") if name == XML else (name, content),
    "UTF-16": lambda name, content: in_encoding(name, content, "UTF-16") if name == XML else (name, content),
}


@pytest.mark.parametrize("kind", READABLE)
def test_archives_as_tools_write_them(make: Callable, scene: Callable, tmp_path: Path, kind: str) -> None:
    make("plain", [real("y")], output="real[0] = t;")
    file = rewritten(tmp_path / "plain.fmu", f"other {kind} ü.fmu", READABLE[kind])
    assert tca.run(scene({"a": file}))["a.y"][-1] == 1.0


REFUSED: dict[str, tuple[Callable[[str, bytes], tuple[str, bytes] | None], str]] = {
    "folder": (lambda name, content: (f"plain/{name}", content), r"it lies at plain/modelDescription.xml"),
    "32 bits": (lambda name, content: (name.replace("linux64", "linux32"), content), r"binaries for linux32; export"),
    "no library": (lambda name, content: None if name.startswith("bin") else (name, content), r"for no platform"),
    "outside": (lambda name, content: (f"../{name}" if name != XML else name, content), r"outside the folder"),
    "no XML": (lambda name, content: None if name == XML else (name, content), r"no modelDescription.xml"),
    "cut XML": (lambda name, content: (name, content[:300]), r"not a readable FMU"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_archives_that_are_refused(make: Callable, scene: Callable, tmp_path: Path, kind: str) -> None:
    make("plain", [real("y")], output="real[0] = t;")
    change, message = REFUSED[kind]
    file = rewritten(tmp_path / "plain.fmu", "other.fmu", change)
    with pytest.raises(tca.CosimError, match=rf"other.fmu.*{message}"):
        tca.run(scene({"a": file}))


def test_files_that_are_no_archives(scene: Callable, tmp_path: Path) -> None:
    (tmp_path / "text.fmu").write_text("hello")
    (tmp_path / "empty.fmu").write_bytes(b"")
    for name in ("text.fmu", "empty.fmu"):
        with pytest.raises(tca.SceneError, match=rf"{name}: not a readable FMU"):
            scene({"a": name})
    with pytest.raises(tca.SceneError, match="no FMU"):
        scene({"a": "x" * 300 + ".fmu"})


def test_resources_in_folders_of_any_name(
    make: Callable, scene: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their location is a URI; long names of FMUs do not make the folder's too long."""
    read = r"""
    char path[4096], *out = path;
    for (const char *in = m->resources + strlen("file://"); *in; out++)
      if (*in == '%') { unsigned code; sscanf(in + 1, "%2x", &code); *out = (char)code; in += 3; } else *out = *in++;
    strcpy(out, "/my file.txt");
    FILE *file = fopen(path, "r");
    if (!file) { LOG(fmi2Error, "cannot open %s", path); return NULL; }
    fscanf(file, "%lf", &memory[0]);
    fclose(file);
    """
    name = "r" * 240
    make(name, [real("y")], output="real[0] = memory[0];", instantiate=read, files={"resources/my file.txt": "42"})
    folder = tmp_path / "a folder ü%41"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    assert tca.run(scene({"a": f"{name}.fmu"}))["a.y"][-1] == 42.0
