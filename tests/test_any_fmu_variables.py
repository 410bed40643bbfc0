"""Scenes of small foreign FMUs: names, vectors, types and values of variables."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from fmu_maker import boolean, enumeration, integer, real, string
from tca_cosim import results
from tca_cosim.fmi.archive import Archive

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
