"""SSP archives of foreign FMUs: how an archive may be written, nested systems, other documents, dictionaries."""

from __future__ import annotations

import re
from collections.abc import Mapping

import pytest
import ssp_maker as ssp
import tca_cosim as tca
from ssp_maker import Reader
from tca_cosim.fmi.archive import cached_archive
from tca_cosim.scene import read


@pytest.mark.parametrize(
    ("text", "how"),
    [
        (ssp.ssd(ssp.system(ssp.PAIR.replace("src.fmu", "My%20Model.fmu"), ssp.WIRE)), {}),
        (ssp.ssd(ssp.system(ssp.PAIR.replace("src.fmu", "My Model.fmu"), ssp.WIRE)), {}),
        (ssp.ssd(ssp.system(ssp.PAIR.replace("resources/src", "./resources/src"), ssp.WIRE)), {}),
        (ssp.ssd(ssp.system(ssp.PAIR.replace("resources/src", "resources\\src"), ssp.WIRE)), {}),
        (ssp.ssd(ssp.system(ssp.PAIR, ssp.WIRE)), {"separator": "\\"}),
        (ssp.ssd(ssp.system(ssp.PAIR, ssp.WIRE)), {"name": "UPPER.SSP"}),
        (b"\xef\xbb\xbf" + ssp.ssd(ssp.system(ssp.PAIR, ssp.WIRE)).encode(), {}),
        (ssp.ssd(ssp.system(ssp.PAIR, ssp.WIRE)).encode("utf-16"), {}),
        (ssp.ssd(ssp.system(ssp.PAIR, ssp.WIRE), version="2.0"), {}),
        (ssp.ssd(ssp.system(ssp.PAIR, ssp.WIRE), attributes='description="two&#10;lines"'), {}),
        (ssp.ssd(ssp.system(ssp.SOURCE.replace('"output"', '"inout"') + ssp.TARGET, ssp.WIRE)), {}),
    ],
)
def test_ways_to_write_an_archive(text: str | bytes, how: Mapping[str, str], reading: Reader) -> None:
    scene = reading(text, {"resources/My Model.fmu": reading.fmus["src.fmu"]}, **how)
    assert [str(c) for c in scene.connections] == ["src.y -> dst.u"]
    assert "\n" not in scene.title


@pytest.mark.parametrize(
    "name", ["Mass 1", "größe", "a-b", "x[1]", "spring->mass", "a=b", "a.b", "body", "-> x", "a/b"]
)
def test_components_have_any_name(name: str, reading: Reader) -> None:
    source = ssp.component(name, "resources/src.fmu", ssp.connector("y", "output"), ssp.binding("k.ssv"))
    files = {"k.ssv": ssp.parameters(ssp.parameter("k", 5))}
    connection = ssp.wire("N/y", "dst/u").replace('"N"', f'"{name.replace(">", "&gt;")}"')
    scene = reading(ssp.ssd(ssp.system(source + ssp.TARGET, connection)), files, overrides=ssp.HELD)
    assert scene.member(name).value("k") == 5.0
    assert tca.run(scene)["dst.u"].to_numpy() == pytest.approx(5.0)


@pytest.mark.parametrize("name", ["coupling", "title", "parameters", "fmus", "stop_time", "connections", "ssp"])
def test_names_of_keys_are_refused(name: str, reading: Reader) -> None:
    source = ssp.component(name, "resources/src.fmu", ssp.connector("y", "output"))
    with pytest.raises(tca.SceneError, match=f"the name '{name}' is taken by a key of scenes; rename it"):
        reading(ssp.ssd(ssp.system(source + ssp.TARGET, ssp.wire(f"{name}/y", "dst/u"))))


INNER = (
    '<ssd:System name="axle">'
    + ssp.system(
        ssp.PAIR,
        ssp.wire("src/y", "out") + ssp.wire("in", "dst/u") + ssp.wire("stiffness", "dst/p"),
        ssp.connector("out", "output", "m")
        + ssp.connector("in", "input", "mm")
        + ssp.connector("stiffness", "parameter", "Pa"),
        "<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues>"
        + ssp.parameters(ssp.parameter("src.k", 2) + ssp.parameter("stiffness", 1))
        + "</ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>",
    )
    + "</ssd:System>"
)


def test_nested_systems_are_flattened(reading: Reader) -> None:
    """Values of the outer system win; units are converted where a connector states one."""
    outer = ssp.component("dst", "resources/dst.fmu", ssp.connector("u", "input", "mm"))
    first = ssp.component("src", "resources/src.fmu", ssp.connector("y", "output", "m"))
    files = {
        "o.ssv": ssp.parameters(
            ssp.parameter("axle.stiffness", 3, unit="kPa") + ssp.parameter("axle.src.k", 4), ssp.UNITS
        )
    }
    wires = ssp.wire("axle/out", "dst/u") + ssp.wire("src/y", "axle/in")
    scene = reading(ssp.ssd(ssp.system(outer + first + INNER, wires, "", ssp.binding("o.ssv"))), files)
    assert {str(c) for c in scene.connections} == {"axle.src.y * 1000 -> dst.u", "src.y * 1000 -> axle.dst.u"}
    assert scene.member("axle.src").value("k") == 4.0
    assert scene.member("axle.dst").value("p") == pytest.approx(3000.0)
    assert scene.member("src").value("k") == 1.0
    changed = read(reading.folder / "s.ssp", ["axle.src.k=6"], cached_archive)
    assert changed.member("axle.src").value("k") == 6.0


def test_systems_of_other_documents(reading: Reader) -> None:
    """A component may be another SSD of the archive, or a system of this one by its id."""
    content = INNER.removeprefix('<ssd:System name="axle">').removesuffix("</ssd:System>")
    other = {"axle.ssd": ssp.ssd(content)}
    definition = 'type="application/x-ssp-definition"'
    part = f'<ssd:Component name="front" source="axle.ssd" {definition}/>'
    scene = reading(ssp.ssd(ssp.system(ssp.TARGET + part, ssp.wire("front/out", "dst/u"))), other)
    assert [m.name for m in scene.members] == ["dst", "front.src", "front.dst"]
    twice = INNER.replace('name="axle"', 'name="axle" id="one"', 1)
    same = f'<ssd:Component name="rear" source="#one" {definition}/>'
    scene = reading(ssp.ssd(ssp.system(ssp.TARGET + twice + same, ssp.wire("rear/out", "dst/u"))))
    assert [m.name for m in scene.members] == ["dst", "axle.src", "axle.dst", "rear.src", "rear.dst"]
    itself = f'<ssd:Component name="front" source="SystemStructure.ssd" {definition}/>'
    with pytest.raises(tca.SceneError, match="contains itself"):
        reading(ssp.ssd(ssp.system(ssp.TARGET + itself)))


def test_prefixes_without_a_namespace_are_named(reading: Reader) -> None:
    text = ssp.ssd(ssp.system(ssp.PAIR, ssp.WIRE)).replace("xmlns:ssd=", "xmlns:sdd=")
    with pytest.raises(tca.SceneError, match=r"ssd.*(not defined|has no namespace; declare xmlns:ssd)"):
        reading(text)
    inner = ssp.ssd(
        ssp.system(ssp.PAIR, ssp.WIRE, more=ssp.binding("").replace("/>", ">").replace(' source=""', "")), version="2.0"
    )
    text = inner.replace("</ssd:ParameterBinding>", "<lost:Set/></ssd:ParameterBinding>")
    with pytest.raises(tca.SceneError, match=r"lost.*(not defined|has no namespace; declare xmlns:lost)"):
        reading(text)


def test_a_package_as_component_runs_as_a_folder_of_the_archive(reading: Reader) -> None:
    """The remedy of the refusal: unpacked into a folder, whose SSD has sources relative to itself."""
    inner = ssp.component("src", "resources/src.fmu", ssp.connector("y", "output"), ssp.binding("../all%20of%20it.ssv"))
    content = ssp.system(inner, ssp.wire("src/y", "out"), ssp.connector("out", "output"))
    unpacked = {
        "part/SystemStructure.ssd": ssp.ssd(content),
        "part/resources/src.fmu": reading.fmus["src.fmu"],
        "all of it.ssv": ssp.parameters(ssp.parameter("k", 4)),
    }
    package = 'type="application/x-ssp-package"'
    part = f'<ssd:Component name="part" source="part.ssp" {package}/>'
    with pytest.raises(tca.SceneError, match=r"source 'part\.ssp' is no FMU") as refused:
        reading(ssp.ssd(ssp.system(ssp.TARGET + part, ssp.wire("part/out", "dst/u"))), {"part.ssp": b""})
    (definition,) = re.findall(r'type="[\w/-]+"', str(refused.value))
    part = part.replace(package, definition).replace("part.ssp", "part/SystemStructure.ssd")
    scene = reading(ssp.ssd(ssp.system(ssp.TARGET + part, ssp.wire("part/out", "dst/u"))), unpacked)
    assert scene.member("part.src").value("k") == 4.0
    assert [str(connection) for connection in scene.connections] == ["part.src.y -> dst.u"]


def test_signal_dictionaries_connect_across_systems(reading: Reader) -> None:
    dictionary = '<ssd:SignalDictionaries><ssd:SignalDictionary name="bus" source="bus.ssb"/></ssd:SignalDictionaries>'
    entries = '<ssb:DictionaryEntry name="speed"><ssc:Real unit="mm"/></ssb:DictionaryEntry>'
    files = {"bus.ssb": f'<ssb:SignalDictionary version="1.0" {ssp.SPACES}>{entries}</ssb:SignalDictionary>'}
    reference = (
        '<ssd:SignalDictionaryReference name="bus" dictionary="bus"><ssd:Connectors>'
        + ssp.connector("speed", "inout")
        + "</ssd:Connectors></ssd:SignalDictionaryReference>"
    )
    second = ssp.pair("", "m").split("</ssd:Component>")[1] + "</ssd:Component>"
    inner = ssp.system(second + reference, ssp.wire("bus/speed", "dst/u"))
    inner = f'<ssd:System name="inner">{inner}</ssd:System>'
    source = ssp.component("src", "resources/src.fmu", ssp.connector("y", "output", "m"))
    scene = reading(
        ssp.ssd(ssp.system(source + reference + inner, ssp.wire("src/y", "bus/speed"), tail=dictionary)), files
    )
    assert [str(c) for c in scene.connections] == ["src.y -> inner.dst.u"]
    with pytest.raises(tca.SceneError, match=r"no such entry; allowed: speed"):
        reading(ssp.ssd(ssp.system(source + reference, ssp.wire("src/y", "bus/force"), tail=dictionary)), files)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (ssp.system(ssp.PAIR, ssp.WIRE + ssp.wire("src/y", "dst/u")), r"dst\.u is fed twice; remove one"),
        (ssp.system(ssp.PAIR, ssp.wire("src/y", "dst/y")), "both are outputs; connect an output to an input"),
        (ssp.system(ssp.PAIR, ssp.wire("src/y", "dst/p")), "from output to parameter is not supported"),
        (ssp.system(ssp.PAIR + ssp.TARGET), "the name is taken by another element; rename one"),
        (ssp.system(ssp.PAIR, ssp.wire("src/y", "nothing/u")), "no such element; allowed: dst, src"),
        (
            ssp.system(
                ssp.PAIR,
                ssp.wire("a", "b") + ssp.wire("b", "a"),
                ssp.connector("a", "input") + ssp.connector("b", "inout"),
            ),
            "b is fed twice",
        ),
        (ssp.system(ssp.SOURCE.replace("resources/src.fmu", "../src.fmu")), "is not in the archive; put it there"),
        (
            ssp.system(ssp.SOURCE.replace("resources/src.fmu", "https://example.org/src.fmu")),
            "lies outside the archive",
        ),
        (
            ssp.system(ssp.SOURCE.replace("resources/src.fmu", "resources/s.ssp")),
            r"is no FMU; put an SSP package's files into",
        ),
    ],
)
def test_systems_without_a_meaning_are_refused(content: str, problem: str, reading: Reader) -> None:
    with pytest.raises(tca.SceneError, match=problem):
        reading(ssp.ssd(content))
