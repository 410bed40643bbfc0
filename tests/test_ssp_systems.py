"""SSP archives of foreign FMUs: how an archive may be written, nested systems, other documents, dictionaries."""

from __future__ import annotations

import re
from collections.abc import Mapping

import pytest
import tca_cosim as tca
from ssp_maker import (
    HELD,
    PAIR,
    SOURCE,
    SPACES,
    TARGET,
    UNITS,
    WIRE,
    Reader,
    binding,
    component,
    connector,
    pair,
    parameter,
    parameters,
    ssd,
    system,
    wire,
)
from tca_cosim.fmi.archive import cached_archive
from tca_cosim.scene import read


@pytest.mark.parametrize(
    ("text", "how"),
    [
        (ssd(system(PAIR.replace("src.fmu", "My%20Model.fmu"), WIRE)), {}),
        (ssd(system(PAIR.replace("src.fmu", "My Model.fmu"), WIRE)), {}),
        (ssd(system(PAIR.replace("resources/src", "./resources/src"), WIRE)), {}),
        (ssd(system(PAIR.replace("resources/src", "resources\\src"), WIRE)), {}),
        (ssd(system(PAIR, WIRE)), {"separator": "\\"}),
        (ssd(system(PAIR, WIRE)), {"name": "UPPER.SSP"}),
        (b"\xef\xbb\xbf" + ssd(system(PAIR, WIRE)).encode(), {}),
        (ssd(system(PAIR, WIRE)).encode("utf-16"), {}),
        (ssd(system(PAIR, WIRE), version="2.0"), {}),
        (ssd(system(PAIR, WIRE), attributes='description="two&#10;lines"'), {}),
        (ssd(system(SOURCE.replace('"output"', '"inout"') + TARGET, WIRE)), {}),
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
    source = component(name, "resources/src.fmu", connector("y", "output"), binding("k.ssv"))
    files = {"k.ssv": parameters(parameter("k", 5))}
    connection = wire("N/y", "dst/u").replace('"N"', f'"{name.replace(">", "&gt;")}"')
    scene = reading(ssd(system(source + TARGET, connection)), files, overrides=HELD)
    assert scene.member(name).value("k") == 5.0
    assert tca.run(scene)["dst.u"].to_numpy() == pytest.approx(5.0)


@pytest.mark.parametrize("name", ["coupling", "title", "parameters", "fmus", "stop_time", "connections", "ssp"])
def test_names_of_keys_are_refused(name: str, reading: Reader) -> None:
    source = component(name, "resources/src.fmu", connector("y", "output"))
    with pytest.raises(tca.SceneError, match=f"the name '{name}' is taken by a key of scenes; rename it"):
        reading(ssd(system(source + TARGET, wire(f"{name}/y", "dst/u"))))


INNER = (
    '<ssd:System name="axle">'
    + system(
        PAIR,
        wire("src/y", "out") + wire("in", "dst/u") + wire("stiffness", "dst/p"),
        connector("out", "output", "m") + connector("in", "input", "mm") + connector("stiffness", "parameter", "Pa"),
        "<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues>"
        + parameters(parameter("src.k", 2) + parameter("stiffness", 1))
        + "</ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>",
    )
    + "</ssd:System>"
)


def test_nested_systems_are_flattened(reading: Reader) -> None:
    """Values of the outer system win; units are converted where a connector states one."""
    outer = component("dst", "resources/dst.fmu", connector("u", "input", "mm"))
    first = component("src", "resources/src.fmu", connector("y", "output", "m"))
    files = {"o.ssv": parameters(parameter("axle.stiffness", 3, unit="kPa") + parameter("axle.src.k", 4), UNITS)}
    wires = wire("axle/out", "dst/u") + wire("src/y", "axle/in")
    scene = reading(ssd(system(outer + first + INNER, wires, "", binding("o.ssv"))), files)
    assert {str(c) for c in scene.connections} == {"axle.src.y * 1000 -> dst.u", "src.y * 1000 -> axle.dst.u"}
    assert scene.member("axle.src").value("k") == 4.0
    assert scene.member("axle.dst").value("p") == pytest.approx(3000.0)
    assert scene.member("src").value("k") == 1.0
    changed = read(reading.folder / "s.ssp", ["axle.src.k=6"], cached_archive)
    assert changed.member("axle.src").value("k") == 6.0


def test_systems_of_other_documents(reading: Reader) -> None:
    """A component may be another SSD of the archive, or a system of this one by its id."""
    content = INNER.removeprefix('<ssd:System name="axle">').removesuffix("</ssd:System>")
    other = {"axle.ssd": ssd(content)}
    definition = 'type="application/x-ssp-definition"'
    part = f'<ssd:Component name="front" source="axle.ssd" {definition}/>'
    scene = reading(ssd(system(TARGET + part, wire("front/out", "dst/u"))), other)
    assert [m.name for m in scene.members] == ["dst", "front.src", "front.dst"]
    twice = INNER.replace('name="axle"', 'name="axle" id="one"', 1)
    same = f'<ssd:Component name="rear" source="#one" {definition}/>'
    scene = reading(ssd(system(TARGET + twice + same, wire("rear/out", "dst/u"))))
    assert [m.name for m in scene.members] == ["dst", "axle.src", "axle.dst", "rear.src", "rear.dst"]
    itself = f'<ssd:Component name="front" source="SystemStructure.ssd" {definition}/>'
    with pytest.raises(tca.SceneError, match="contains itself"):
        reading(ssd(system(TARGET + itself)))


def test_prefixes_without_a_namespace_are_named(reading: Reader) -> None:
    text = ssd(system(PAIR, WIRE)).replace("xmlns:ssd=", "xmlns:sdd=")
    with pytest.raises(tca.SceneError, match=r"ssd.*(not defined|has no namespace; declare xmlns:ssd)"):
        reading(text)
    inner = ssd(system(PAIR, WIRE, more=binding("").replace("/>", ">").replace(' source=""', "")), version="2.0")
    text = inner.replace("</ssd:ParameterBinding>", "<lost:Set/></ssd:ParameterBinding>")
    with pytest.raises(tca.SceneError, match=r"lost.*(not defined|has no namespace; declare xmlns:lost)"):
        reading(text)


def test_a_package_as_component_runs_as_a_folder_of_the_archive(reading: Reader) -> None:
    """The remedy of the refusal: unpacked into a folder, whose SSD has sources relative to itself."""
    inner = component("src", "resources/src.fmu", connector("y", "output"), binding("../all%20of%20it.ssv"))
    content = system(inner, wire("src/y", "out"), connector("out", "output"))
    unpacked = {
        "part/SystemStructure.ssd": ssd(content),
        "part/resources/src.fmu": reading.fmus["src.fmu"],
        "all of it.ssv": parameters(parameter("k", 4)),
    }
    package = 'type="application/x-ssp-package"'
    part = f'<ssd:Component name="part" source="part.ssp" {package}/>'
    with pytest.raises(tca.SceneError, match=r"source 'part\.ssp' is no FMU") as refused:
        reading(ssd(system(TARGET + part, wire("part/out", "dst/u"))), {"part.ssp": b""})
    (definition,) = re.findall(r'type="[\w/-]+"', str(refused.value))
    part = part.replace(package, definition).replace("part.ssp", "part/SystemStructure.ssd")
    scene = reading(ssd(system(TARGET + part, wire("part/out", "dst/u"))), unpacked)
    assert scene.member("part.src").value("k") == 4.0
    assert [str(connection) for connection in scene.connections] == ["part.src.y -> dst.u"]


def test_signal_dictionaries_connect_across_systems(reading: Reader) -> None:
    dictionary = '<ssd:SignalDictionaries><ssd:SignalDictionary name="bus" source="bus.ssb"/></ssd:SignalDictionaries>'
    entries = '<ssb:DictionaryEntry name="speed"><ssc:Real unit="mm"/></ssb:DictionaryEntry>'
    files = {"bus.ssb": f'<ssb:SignalDictionary version="1.0" {SPACES}>{entries}</ssb:SignalDictionary>'}
    reference = (
        '<ssd:SignalDictionaryReference name="bus" dictionary="bus"><ssd:Connectors>'
        + connector("speed", "inout")
        + "</ssd:Connectors></ssd:SignalDictionaryReference>"
    )
    inner = f'<ssd:System name="inner">{system(pair("", "m").split("</ssd:Component>")[1] + "</ssd:Component>" + reference, wire("bus/speed", "dst/u"))}</ssd:System>'  # noqa: E501
    source = component("src", "resources/src.fmu", connector("y", "output", "m"))
    scene = reading(ssd(system(source + reference + inner, wire("src/y", "bus/speed"), tail=dictionary)), files)
    assert [str(c) for c in scene.connections] == ["src.y -> inner.dst.u"]
    with pytest.raises(tca.SceneError, match=r"no such entry; allowed: speed"):
        reading(ssd(system(source + reference, wire("src/y", "bus/force"), tail=dictionary)), files)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (system(PAIR, WIRE + wire("src/y", "dst/u")), r"dst\.u is fed twice; remove one"),
        (system(PAIR, wire("src/y", "dst/y")), "both are outputs; connect an output to an input"),
        (system(PAIR, wire("src/y", "dst/p")), "from output to parameter is not supported"),
        (system(PAIR + TARGET), "the name is taken by another element; rename one"),
        (system(PAIR, wire("src/y", "nothing/u")), "no such element; allowed: dst, src"),
        (
            system(PAIR, wire("a", "b") + wire("b", "a"), connector("a", "input") + connector("b", "inout")),
            "b is fed twice",
        ),
        (system(SOURCE.replace("resources/src.fmu", "../src.fmu")), "is not in the archive; put it there"),
        (system(SOURCE.replace("resources/src.fmu", "https://example.org/src.fmu")), "lies outside the archive"),
        (system(SOURCE.replace("resources/src.fmu", "resources/s.ssp")), r"is no FMU; put an SSP package's files into"),
    ],
)
def test_systems_without_a_meaning_are_refused(content: str, problem: str, reading: Reader) -> None:
    with pytest.raises(tca.SceneError, match=problem):
        reading(ssd(content))
