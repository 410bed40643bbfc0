"""Connections of a scene: units, types, names with any character, vectors; values that arrive."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import tca_cosim as tca
from fmu_maker import Variable, boolean, enumeration, integer, make_fmu, real
from tca_cosim.cosim.converted_inputs import convert_inputs
from tca_cosim.cosim.subsystem import Port
from tca_cosim.cosim.topology import Connection
from tca_cosim.fmi.archive import cached_archive
from tca_cosim.scene import read
from tca_cosim.scene.unit_conversion import Unit
from tca_cosim.studies.stability.model_problems import linear

KELVIN = '<Unit name="K"><BaseUnit K="1"/></Unit>'
CELSIUS = '<Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>'
HELD = {"exchange": "held", "waveform": "held", "macro_step": 0.5}


def source(path: Path, unit: str | None = None, units: str = "", value: float = 300.0, **more: object) -> Path:
    attributes = more if unit is None else {"unit": unit, **more}
    return make_fmu(path, [real("T", **attributes)], output=f"real[0] = {value};", units=units)


def target(path: Path, unit: str | None = None, units: str = "", **more: object) -> Path:
    attributes = more if unit is None else {"unit": unit, **more}
    return make_fmu(
        path, [real("T", "input", start=0, **attributes), real("y")], output="real[1] = real[0];", units=units
    )


def scene(folder: Path, connections: list[Any], **members: str) -> tca.Scene:
    described = {"stop_time": 1.0, "connections": connections, "coupling": HELD}
    described["fmus"] = {name: str(folder / file) for name, file in members.items()}
    return read(described, (), cached_archive)


TONNE = '<Unit name="t"><BaseUnit kg="1" factor="1000"/></Unit>'
SHORT = '<Unit name="t"><BaseUnit kg="1" factor="907.18474"/></Unit>'
NM = '<Unit name="Nm"><BaseUnit kg="1" m="2" s="-2"/></Unit>'
N_M = '<Unit name="N.m"><BaseUnit kg="1" m="2" s="-2"/></Unit>'
RPM = '<Unit name="rpm"><BaseUnit s="-1" rad="1" factor="0.10471975511965977"/></Unit>'
HERTZ = '<Unit name="Hz"><BaseUnit s="-1"/></Unit>'


@pytest.mark.parametrize(
    ("gives", "takes", "expected"),
    [
        (("K", KELVIN), ("K", KELVIN), 300.0),
        (("K", '<Unit name="K"/>'), ("K", KELVIN), 300.0),
        (("K", ""), ("K", KELVIN), 300.0),
        ((None, ""), ("K", KELVIN), 300.0),
        (("", ""), ("K", KELVIN), 300.0),
        (("1", '<Unit name="1"><BaseUnit/></Unit>'), ("K", KELVIN), r"'1' \(1\) and 'K' \(K\)"),
        (("-", '<Unit name="-"/>'), ("K", KELVIN), "'-' has no definition by base units"),
        (("degC", CELSIUS), ("K", KELVIN), 573.15),
        (("K", KELVIN), ("degC", CELSIUS), 26.85),
        (("t", TONNE), ("t", SHORT), 300 * 1000 / 907.18474),
        (("Nm", NM), ("N.m", N_M), 300.0),
        (("rpm", RPM), ("Hz", HERTZ), r"'rpm' \(s-1\.rad\) and 'Hz' \(s-1\) do not measure the same quantity"),
        (("Hz", HERTZ), ("1/s", ""), "'1/s' has no definition"),
    ],
)
def test_units_of_connected_variables(
    gives: tuple[str | None, str], takes: tuple[str | None, str], expected: float | str, tmp_path: Path
) -> None:
    """Units are the same if exponents, factor and offset are; else values are converted, or the wire is refused."""
    source(tmp_path / "a.fmu", *gives)
    target(tmp_path / "b.fmu", *takes)
    if isinstance(expected, str):
        with pytest.raises(tca.SceneError, match=expected):
            scene(tmp_path, ["a.T -> b.T"], a="a.fmu", b="b.fmu")
        return
    result = tca.run(scene(tmp_path, ["a.T -> b.T"], a="a.fmu", b="b.fmu"))
    assert result["b.y"].to_numpy() == pytest.approx(expected)


def test_differences_have_no_offset(tmp_path: Path) -> None:
    source(tmp_path / "a.fmu", "degC", CELSIUS, 5.0, relativeQuantity="true")
    target(tmp_path / "b.fmu", "K", KELVIN, relativeQuantity="true")
    target(tmp_path / "c.fmu", "K", KELVIN)
    result = tca.run(scene(tmp_path, ["a.T -> b.T"], a="a.fmu", b="b.fmu"))
    assert result["b.y"].to_numpy() == pytest.approx(5.0)
    with pytest.raises(tca.SceneError, match=r"is a difference .* and the other a value; connect like to like"):
        scene(tmp_path, ["a.T -> c.T"], a="a.fmu", c="c.fmu")


@pytest.mark.parametrize(("units", "unit"), [(CELSIUS, "degC"), (KELVIN, "K")])
def test_parameters_that_are_differences(units: str, unit: str, tmp_path: Path) -> None:
    variables = [
        real("dT", "parameter", start=1, unit=unit, relativeQuantity="true"),
        real("T", "parameter", unit=unit),
    ]
    make_fmu(tmp_path / "a.fmu", [*variables, real("y")], units=units)
    described = {"stop_time": 1, "connections": [], "fmus": {"a": str(tmp_path / "a.fmu")}}
    actual = read({**described, "a": {"dT": "5 degC", "T": "300 K"}}, (), cached_archive).member("a")
    assert actual.value("dT") == 5.0
    assert actual.value("T") == pytest.approx(26.85 if unit == "degC" else 300.0)


NAMES = ["dy/dt", "speed [km/h]", "P/Q", "größe", "x -> y", 'say "hi"', "a.b.c", "100 %", "T[1]", "T[0]"]


def test_names_hold_any_character(tmp_path: Path) -> None:
    gives = [real(name) for name in NAMES]
    takes = [real(name, "input", start=0) for name in NAMES]
    make_fmu(tmp_path / "a.fmu", gives, output="".join(f"real[{k}] = {k + 1};" for k in range(len(NAMES))))
    make_fmu(tmp_path / "b.fmu", [*takes, real("y")])
    actual = scene(tmp_path, [f"a.{name} -> b.{name}" for name in NAMES[:-2]], a="a.fmu", b="b.fmu")
    assert [(c.source[1], c.target[1]) for c in actual.connections] == [(name, name) for name in NAMES[:-2]]
    result = tca.run(actual)
    tca.write(result, tmp_path / "r.nc")
    tca.write(result, tmp_path / "r.csv")
    assert result["b.dy/dt"].to_numpy()[-1] == 1.0
    assert result["b.x -> y"].to_numpy()[-1] == 5.0


def test_elements_go_by_index(tmp_path: Path) -> None:
    """Elements in the XML in alphabetical order, on the other side by number."""
    order = sorted(range(1, 13), key=str)
    make_fmu(
        tmp_path / "a.fmu",
        [real(f"y[{k}]") for k in order],
        output="".join(f"real[{n}] = {k};" for n, k in enumerate(order)),
    )
    make_fmu(tmp_path / "b.fmu", [real(f"u[{k}]", "input", start=0) for k in range(1, 13)])
    actual = scene(tmp_path, ["a.y -> b.u"], a="a.fmu", b="b.fmu")
    assert {(c.source[1][1:], c.target[1][1:]) for c in actual.connections} == {(f"[{k}]",) * 2 for k in range(1, 13)}
    assert tca.run(actual)["b.u"].to_numpy()[-1].tolist() == list(range(1, 13))


def kinds(causality: str) -> list[Variable]:
    start = {} if causality == "output" else {"start": 0}
    return [
        integer("n", causality, **start),
        boolean("on", causality, **({} if causality == "output" else {"start": "false"})),
        enumeration("gear", causality, declaredType="Gear", **start),
    ]


GEAR = '<SimpleType name="Gear"><Enumeration>{}</Enumeration></SimpleType>'
ITEMS = '<Item name="reverse" value="-1"/><Item name="neutral" value="0"/>'


def test_like_types_are_connected(tmp_path: Path) -> None:
    output = "integer[0] = 7; boolean[0] = 1; integer[1] = -1;"
    make_fmu(tmp_path / "a.fmu", [*kinds("output"), real("x")], output=output, types=GEAR.format(ITEMS))
    make_fmu(
        tmp_path / "b.fmu",
        [*kinds("input"), real("y")],
        output="real[0] = integer[0] + 100 * boolean[0] + 1000 * integer[1];",
        types=GEAR.format(ITEMS),
    )
    make_fmu(tmp_path / "c.fmu", [*kinds("input"), real("y")], types=GEAR.format(ITEMS.replace("-1", "5")))
    result = tca.run(scene(tmp_path, ["a.n -> b.n", "a.on -> b.on", "a.gear -> b.gear"], a="a.fmu", b="b.fmu"))
    assert result["b.y"].to_numpy()[-1] == 7 + 100 - 1000
    for text, problem in {
        "a.n -> b.on": "types differ: Integer and Boolean; connect variables of one type",
        "a.n -> b.y": "'b.y' is not an input; allowed: gear, n, on",
        "a.m -> b.n": "'a.m' is not an output; allowed: gear, n, on, x",
    }.items():
        with pytest.raises(tca.SceneError, match=problem.replace(".", r"\.")):
            scene(tmp_path, [text], a="a.fmu", b="b.fmu")
    with pytest.raises(tca.SceneError, match="items differ"):
        scene(tmp_path, ["a.gear -> c.gear"], a="a.fmu", c="c.fmu")


def test_discrete_inputs_follow_steps(tmp_path: Path) -> None:
    output = "real[0] = integer[0] + 100 * boolean[0];"
    file = make_fmu(tmp_path / "b.fmu", [*kinds("input"), real("y")], output=output, types=GEAR.format(ITEMS))
    described = {"stop_time": 1, "connections": [], "fmus": {"b": str(file)}, "coupling": {"macro_step": 0.25}}
    steps = {"n": {"steps": [[0, 0], [0.5, 5]]}, "on": {"steps": [[0, False], [0.5, True]]}, "gear": "reverse"}
    result = tca.run(read({**described, "b": steps}, (), cached_archive))
    assert result["b.y"].to_numpy()[[0, 1, -1]].tolist() == [0.0, 0.0, 105.0]
    for value, problem in {
        "n": ({"ramps": [[0, 0], [1, 5]]}, "the variable is Integer, so it cannot follow ramps; give steps"),
        "on": ({"steps": [[0, 1]]}, "wrong type; allowed: true, false"),
        "gear": (7, r"not the value of an item; allowed: reverse \(-1\), neutral \(0\)"),
    }.items():
        raw, text = problem
        with pytest.raises(tca.SceneError, match=text):
            read({**described, "b": {value: raw}}, (), cached_archive)


def test_start_values_of_states_are_set(tmp_path: Path) -> None:
    states = [real("x", "output", start=1, initial="exact"), real("v", "local", start=0, initial="exact")]
    variables = [*states, real("k", "local", variability="constant", start=2), real("y")]
    file = make_fmu(tmp_path / "a.fmu", variables, output="real[3] = real[0] + 10 * real[1];")
    described = {"stop_time": 0.1, "connections": [], "fmus": {"a": str(file)}}
    assert tca.run({**described, "a": {"x": 2.0, "v": 3.0}})["a.y"][0] == 32.0
    for name, causality in {"k": "local", "y": "output"}.items():
        with pytest.raises(tca.SceneError, match=f"a.{name} = 1: is {causality}; only parameters, inputs and start"):
            tca.read({**described, "a": {name: 1}})


def test_tables_say_what_a_text_cannot(tmp_path: Path) -> None:
    source(tmp_path / "a.fmu")
    target(tmp_path / "b.fmu")
    entry = {"from": "a.T", "to": "b.T", "factor": 2, "offset": 1.5}
    result = tca.run(scene(tmp_path, [entry], a="a.fmu", b="b.fmu"))
    assert result["b.y"].to_numpy()[-1] == 601.5
    for change, problem in {
        ("factor", 0): "factor is 0; remove the connection",
        ("factor", "2"): "factor = '2': give a finite number",
        ("offset", float("nan")): "offset = nan: give a finite number",
        ("gain", 2): "unknown 'gain'; allowed: from, to, factor, offset, convert",
        ("from", 3): "3: give a text 'fmu.variable'",
    }.items():
        with pytest.raises(tca.SceneError, match=problem):
            scene(tmp_path, [{**entry, change[0]: change[1]}], a="a.fmu", b="b.fmu")
    for wrong in (3, "a.T b.T", {"from": "a.T"}):
        with pytest.raises(tca.SceneError, match=r"give 'fmu\.output -> fmu\.input'"):
            scene(tmp_path, [wrong], a="a.fmu", b="b.fmu")


def test_ports_of_wired_inputs_are_in_the_unit_of_their_source() -> None:
    """y = 2 x + 10: start, limits and nominal as the source sees them."""
    inner = linear("plant", [], [], [], [1.0], [], "u", "y")
    inner.inputs = (Port("u", nominal=4.0, start=16.0, least=0.0, most=20.0),)
    seen = convert_inputs(inner, [Connection(("a", "x"), ("plant", "u"), 2.0, 10.0)])
    (port,) = seen.inputs
    assert (port.start, port.nominal, port.least, port.most) == (3.0, 2.0, -5.0, 5.0)
    seen = convert_inputs(inner, [Connection(("a", "x"), ("plant", "u"), -2.0, 10.0)])
    assert (seen.inputs[0].least, seen.inputs[0].most) == (-5.0, 5.0)


def test_units_are_converted_unless_a_table_says_otherwise(tmp_path: Path) -> None:
    source(tmp_path / "a.fmu", "degC", CELSIUS)
    target(tmp_path / "b.fmu", "K", KELVIN)
    for more, expected in (({}, 573.15), ({"convert": True}, 573.15), ({"convert": False}, 300.0)):
        result = tca.run(scene(tmp_path, [{"from": "a.T", "to": "b.T", **more}], a="a.fmu", b="b.fmu"))
        assert result["b.y"].to_numpy() == pytest.approx(expected)


def test_a_unit_without_a_definition_is_not_the_unit_one() -> None:
    assert Unit("1").exponents == {}
    assert Unit("mol").exponents is None
