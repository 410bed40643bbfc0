"""Parts of a scene on their own: summary, titles, files, refusals of tables, values of members, TOML."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import tca_cosim as tca
from tca_cosim.cosim.signals import Constant, Impulse, Sine, Steps
from tca_cosim.errors import SceneError
from tca_cosim.scene.layers import find
from tca_cosim.scene.loop_closure import closed_inside
from tca_cosim.scene.summary import _number, _signal
from tca_cosim.scene.toml_writer import _located

MINE: dict[str, Any] = {
    "name": "mine",
    "title": "A <b>",
    "stop_time": 2,
    "thermal": {"V": [0, 1.5, {"sine": {"amplitude": 1, "period": 4, "offset": 2}}]},
    "rod": {"strains": "kirchhoff", "body": {"E": 5e4}, "dynamic": False},
}


def test_a_scene_in_words() -> None:
    lines = str(tca.read(MINE)).splitlines()
    assert lines[:4] == [
        "Scene 'mine': A <b>",
        "  time      2 s in macro steps of 0.1 s (fixed)",
        "  coupling  iqn, tolerance 1e-06, gauss_seidel",
        "  thermal   thermal.fmu; V[1] = 0 V, V[2] = 1.5 V, V[3] = sine(offset 2, amplitude 1, period 4, phase 0) V",
    ]
    assert lines[4].startswith("  rod       rod.fmu; strains kirchhoff, ")
    assert "body.E 50000.0 Pa" in lines[4]
    assert lines[4].endswith("dynamic False")  # and not the order, which is the FMU's own
    assert "order" not in lines[4]
    assert lines[5:] == ["  wires     thermal.T -> rod.T"]


def test_values_that_are_the_start_values_are_not_named() -> None:
    plain = tca.read({"stop_time": 1, "rod": {"order": 4, "dynamic": True}})
    assert "  rod       rod.fmu\n" in str(plain)


def test_a_scene_as_a_table_is_escaped() -> None:
    html = tca.read(MINE)._repr_html_()
    assert html.startswith("<table><caption><b>Scene mine</b>: A &lt;b&gt;</caption><tr><th style=")
    assert html.count("<tr>") == 5
    assert "thermal.T -&gt; rod.T" in html


@pytest.mark.parametrize(
    ("signal", "text"),
    [
        (Constant(2.0), "2"),
        (Sine(1.0, 2.0, 3.0), "sine(offset 1, amplitude 2, period 3, phase 0)"),
        (Steps((0.0, 1.0, 2.0), (3.0, 4.0, 5.0)), "steps(times [0, 1, 2], values [3, 4, 5])"),
        (Steps((0.0,), (3.0,)), "steps(times [0], values [3])"),
    ],
)
def test_signals_in_words(signal: Any, text: str) -> None:
    assert _signal(signal) == text
    assert _number((1.0, 2.5)) == "[1, 2.5]"
    assert _number(tuple(range(6))) == "[0, 1, 2, 3, 4, 5]"
    assert _number(tuple(range(7))) == "[0, 1, 2, 3, 4, 5, ...]"


@pytest.mark.parametrize(
    ("overrides", "title"),
    [
        ([], "Step: V = (0, 1.5, 3) V"),
        (["coupling.method=iqn", "fidelity.level=given"], "Step: V = (0, 1.5, 3) V"),
        (["title=a  b"], "a b"),
        (["rod.order=3", "coupling.method=iqn"], "Step: V = (0, 1.5, 3) V (modified: rod.order=3)"),
        (
            ["rod.order=3", "stop_time=1", "rod.dynamic=false"],
            "Step: V = (0, 1.5, 3) V (modified: rod.order=3, stop_time=1, rod.dynamic=false)",
        ),
        (
            ["rod.order=3", "stop_time=1", "rod.dynamic=false", "rod.body.E=4e4"],
            "Step: V = (0, 1.5, 3) V (modified: rod.order=3, stop_time=1, rod.dynamic=false, and 1 more)",
        ),
    ],
)
def test_titles_name_what_overrides_change(overrides: list[str], title: str) -> None:
    assert tca.read("step", overrides).title == title


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"title": 3}, "title = 3: wrong type; give one line of text in quotes"),
        ({"fidelity": 3}, "fidelity = 3: give a table [fidelity]"),
        ({"fidelity": {"quantities": "rod.tip.p"}}, "fidelity.quantities = 'rod.tip.p': give a list of outputs"),
        ({"fidelity": {"quantities": []}}, "fidelity.quantities = []: give a list of outputs, such as ['rod.tip.p']"),
        ({"fidelity": {"quantities": ["rod.tip.p", 1]}}, "fidelity.quantities = ['rod.tip.p', 1]: give a list"),
        ({"fidelity": {"quantities": ["rod.tip.q"]}}, "is not a Real output; did you mean 'rod.tip.v'?"),
        ({"fidelity": {"quantities": ["rod.order"]}}, "fidelity.quantities = 'rod.order': is not a Real output"),
        ({"fidelity": {"quantities": ["rod.tip.p[1]"]}}, "give the whole vector, 'rod.tip.p'"),
        ({"fmus": {}}, "fmus = {}: give a table of name = 'file.fmu'"),
        ({"fmus": ["rod.fmu"]}, "fmus = ['rod.fmu']: give a table of name = 'file.fmu'"),
        ({"fmus": {"coupling": "rod.fmu"}}, "the name 'coupling' is taken by a key of scenes; rename the FMU"),
        ({"fmus": {"rod": 3}}, "fmus.rod = 3: wrong type; give a file name such as 'rod.fmu'"),
        ({"body": 3}, "body = 3: give a table [body]"),
        ({"body": {"radius": "5 mm"}, "rod": 3}, "rod"),
    ],
)
def test_tables_that_are_none_are_refused(table: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError) as error:
        tca.read({"stop_time": 1, **table})
    assert message in str(error.value)


# -- files


def test_files_and_names_of_scenes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "near").mkdir()
    for name in ("own.toml", "OWN2.TOML", "near/other.toml", "text.txt"):
        (tmp_path / name).write_text("stop_time = 1\n")
    assert find("own.toml", "scenes", "scene") == Path("own.toml")
    assert find("OWN2.TOML", "scenes", "scene") == Path("OWN2.TOML")
    assert find("other.toml", "scenes", "scene", tmp_path / "near") == tmp_path / "near" / "other.toml"
    assert find("step", "scenes", "scene").name == "step.toml"
    assert find("step", "scenes", "scene").parent.name == "scenes"


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("text.txt", "text.txt: a file, but not a scene; allowed: .toml or .ssp files, or a name"),
        ("folder", "folder: a folder, not a scene; give a .toml or .ssp file in it"),
        ("missing.toml", "no scene 'missing.toml': no such file in {here}; check the path. Names that come with"),
        ("missing.SSP", "no scene 'missing.SSP': no such file in {here}; check the path. Names that come with"),
        ("folder/missing", "no scene 'folder/missing': no such file in {here}; check the path. Names that come with"),
        ("stepp", "no scene 'stepp': no such file, and did you mean 'step'?"),
    ],
)
def test_what_is_no_scene_is_named(source: str, message: str, here: Path) -> None:
    (here / "text.txt").write_text("")
    with pytest.raises(SceneError) as error:
        find(source, "scenes", "scene")
    assert str(error.value).startswith(message.format(here=here))


def test_files_of_scenes_become_absolute_where_they_name_files(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("")
    absolute = str(tmp_path / "a.csv")
    assert _located("a.csv", tmp_path, True) == absolute
    assert _located("a.csv", tmp_path, False) == "a.csv"
    assert _located("b.csv", tmp_path, True) == "b.csv"
    assert _located({"file": "a.csv", "column": "a.csv"}, tmp_path, False) == {"file": absolute, "column": "a.csv"}
    assert _located([{"x": "a.csv"}], tmp_path, True) == [{"x": absolute}]
    assert _located(3, tmp_path, True) == 3


# -- members


def test_values_of_members() -> None:
    scene = tca.read({"stop_time": 1, "tca": {"azimuth": [0.1, 0.2, 0.3]}, "rod": {"body": {"E": 4e4}}})
    rod = scene.member("rod")
    assert rod.reals("tca.azimuth") == (0.1, 0.2, 0.3)
    assert rod.each("tca.azimuth", 3) == (0.1, 0.2, 0.3)
    assert rod.each("body.E", 2) == (4e4, 4e4)
    assert rod.value("nothing") is None
    assert rod.real("nothing") == 0.0
    assert rod.has("body.E")
    assert not rod.has("body.F")
    assert rod.acts("tca.azimuth")
    assert not rod.acts("tca.helix")
    assert not rod.acts("nothing")
    with pytest.raises(SceneError, match=r"rod: rod.fmu has no vector 'nothing'; give an FMU that has it"):
        rod.reals("nothing")


@pytest.mark.parametrize(
    ("signal", "least", "most"),
    [
        (Sine(1.0, 2.0, 3.0), -1.0, 3.0),
        (Sine(1.0, -2.0, 3.0), -1.0, 3.0),
        (Constant(2.0), 2.0, 2.0),
        (Steps((0.0, 1.0), (3.0, -4.0)), -4.0, 3.0),
        (Impulse(peak=-2.0, start=0.0, width=1.0), -2.0, 0.0),
    ],
)
def test_extremes_bound_a_signal(signal: Any, least: float, most: float) -> None:
    assert (min(signal.extremes), max(signal.extremes)) == (least, most)


# -- tables of values in CSV files


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("time,T\n0,300\n1,10000\n", None),
        ("time,T\n0,1\n1,300\n", None),
        ("time,T\n0,300\n1,10001\n", "10001 is out of range; allowed: 1 to 10000"),
        ("time,T\n0,0.5\n1,300\n", "0.5 is out of range; allowed: 1 to 10000"),
        ("time,T\n1,300\n0,301\n", "times must increase; sort the rows, one for each time"),
    ],
)
def test_values_of_a_table_are_in_range_and_in_order(rows: str, message: str | None, here: Path) -> None:
    (here / "table.csv").write_text(rows)
    table = {"stop_time": 1, "thermal": {"T_ambient": {"file": "table.csv", "column": "T"}}}
    if message is None:
        assert tca.read(table).member("thermal").signals["T_ambient"].degree == 1
        return
    with pytest.raises(SceneError) as error:
        tca.read(table)
    assert message in str(error.value)


# -- what is wired and recorded


def test_the_loop_is_closed_inside_where_the_master_would_close_it() -> None:
    scene = tca.read("step", ["rod.closure=exchanged"])
    closed = closed_inside(scene)
    assert (scene.member("rod").value("closure"), closed.member("rod").value("closure")) == (2, 1)
    dropped = {str(c) for c in scene.connections} - {str(c) for c in closed.connections}
    assert dropped == {f"rod.delta[{i}] -> rod.delta_guess[{i}]" for i in (1, 2, 3)}
    assert {str(c) for c in closed.connections} == {f"thermal.T[{i}] -> rod.T[{i}]" for i in (1, 2, 3)}
    assert closed_inside(closed).connections == closed.connections


def test_lists_have_the_shape_of_their_vector() -> None:
    flat = tca.read({"stop_time": 1, "rod": {"segment": {"radius": [[5e-3, 4e-3]]}, "dynamic": False}}).member("rod")
    assert flat.reals("segment.radius") == (5e-3, 4e-3)
    with pytest.raises(
        SceneError, match=r"rod.segment.radius = .*: another shape; give lists of 1 lists of 2 elements"
    ):
        tca.read({"stop_time": 1, "rod": {"segment": {"radius": [[5e-3, 4e-3, 3e-3]]}}})


@pytest.mark.parametrize(
    ("record", "message"),
    [
        ("rod.order", "record = 'rod.order': wrong type; give a list of 'fmu.variable'"),
        (["rod.ordr"], "record = 'rod.ordr': no such variable; did you mean 'rod.order'?"),
    ],
)
def test_what_cannot_be_recorded(record: Any, message: str) -> None:
    with pytest.raises(SceneError) as error:
        tca.read({"stop_time": 1, "record": record})
    assert message in str(error.value)


def test_vectors_are_recorded_whole() -> None:
    recorded = tca.read({"stop_time": 1, "record": ["rod.tca.azimuth", "rod.order"]}).member("rod").recorded
    assert recorded == {"tca.azimuth[1]", "tca.azimuth[2]", "tca.azimuth[3]", "order"}


@pytest.mark.parametrize(
    ("radius", "offset", "message"),
    [
        ("4.5 mm", "2.2 mm", None),
        ("4 mm", "2 mm", None),
        ("5 mm", "2.5 mm", None),
        ("3.9 mm", "2.2 mm", "body.radius = 0.0039 m"),
        ("5.1 mm", "2.2 mm", "body.radius = 0.0051 m"),
        ("4.5 mm", "1.9 mm", "tca.offset[1] = 0.0019 m"),
        ("4.5 mm", "2.6 mm", "tca.offset[1] = 0.0026 m"),
    ],
)
def test_a_section_occurs_in_its_part_of_the_body(radius: str, offset: str, message: str | None) -> None:
    """The rod goes from 5 to 4 mm, its TCAs from 2.5 to 2 mm; the thermal FMU has one section of it."""
    overrides = ["rod.segment.radius[1,2]=4 mm", *(f"rod.tca.offset_end[{i}]=2 mm" for i in (1, 2, 3))]
    overrides += [f"thermal.body.radius={radius}", *(f"thermal.tca.offset[{i}]={offset}" for i in (1, 2, 3))]
    if message is None:
        tca.read("step", overrides)
        return
    with pytest.raises(SceneError) as error:
        tca.read("step", overrides)
    assert message in str(error.value)
    assert "lies in a part of the body with" in str(error.value)


@pytest.mark.parametrize(
    ("given", "signal"),
    [
        ({"sine": {"amplitude": 1, "period": 4}}, Sine(0.0, 1.0, 4.0, 0.0)),
        ({"sine": {"amplitude": 1, "period": 4, "offset": 2, "phase": 0.5}}, Sine(2.0, 1.0, 4.0, 0.5)),
        ({"impulse": {"peak": 1, "width": 2}}, Impulse(1.0, 2.0, 0.0)),
        ({"steps": [[0, 1], [2, 3]]}, Steps((0.0, 2.0), (1.0, 3.0))),
        (2.5, Constant(2.5)),
    ],
)
def test_what_a_signal_does_not_say_is_zero(given: Any, signal: Any) -> None:
    assert tca.read({"stop_time": 1, "thermal": {"V": [0, 0, given]}}).member("thermal").signals["V[3]"] == signal


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"convert": "no"}, "convert = 'no': wrong type; allowed: true, false"),
        ({"convert": 0}, "convert = 0: wrong type; allowed: true, false"),
        ({"factor": 0}, "factor is 0; remove the connection and set the input to the offset"),
    ],
)
def test_what_a_connection_cannot_be(entry: dict[str, Any], message: str) -> None:
    wire = {"from": "thermal.T", "to": "rod.T", **entry}
    with pytest.raises(SceneError) as error:
        tca.read({"stop_time": 1, "connections": [wire]})
    assert message in str(error.value)
