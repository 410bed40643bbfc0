"""SSP archives of foreign FMUs: what reaches which variable, through systems, dictionaries, mappings and units."""

from __future__ import annotations

import warnings
import zipfile
from collections.abc import Mapping
from pathlib import Path

import pytest
import tca_cosim as tca
from fmu_maker import boolean, integer, make_fmu, real
from tca_cosim.fmi.archive import cached_archive
from tca_cosim.scene import read

SPACES = " ".join(
    f'xmlns:{short}="http://ssp-standard.org/SSP1/SystemStructure{name}"'
    for short, name in {
        "ssc": "Common",
        "ssd": "Description",
        "ssv": "ParameterValues",
        "ssm": "ParameterMapping",
        "ssb": "SignalDictionary",
    }.items()
)
UNITS = (
    '<ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit>'
    '<ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>'
    '<ssc:Unit name="K"><ssc:BaseUnit K="1"/></ssc:Unit>'
    '<ssc:Unit name="degC"><ssc:BaseUnit K="1" offset="273.15"/></ssc:Unit>'
    '<ssc:Unit name="Pa"><ssc:BaseUnit kg="1" m="-1" s="-2"/></ssc:Unit>'
    '<ssc:Unit name="kPa"><ssc:BaseUnit kg="1" m="-1" s="-2" factor="1000"/></ssc:Unit>'
)
OMS = (
    '<ssd:Annotations><ssc:Annotation type="org.openmodelica"><oms:Annotations xmlns:oms="x">{}</oms:Annotations>'
    "</ssc:Annotation></ssd:Annotations>"
)


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """src: y = k; dst: y = u + 1000 p; none of them has units, celsius has."""
    folder = tmp_path_factory.mktemp("fmus")
    source = [real("y"), real("k", "parameter", start=1), boolean("on", "parameter", start="false")]
    target = [
        real("u", "input", start=0),
        real("y"),
        real("p", "parameter", start=7),
        integer("n", "parameter", start=0),
    ]
    celsius = [real("u", "input", start=0, unit="degC"), real("y", unit="degC")]
    made = [
        make_fmu(folder / "src.fmu", source, output="real[0] = real[1];"),
        make_fmu(folder / "dst.fmu", target, output="real[1] = real[0] + 1000 * real[2];"),
        make_fmu(
            folder / "celsius.fmu",
            celsius,
            output="real[1] = real[0];",
            units='<Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>',
        ),
    ]
    return {path.name: path.read_bytes() for path in made}


def connector(name: str, kind: str, unit: str = "") -> str:
    inner = f'<ssc:Real unit="{unit}"/>' if unit else "<ssc:Real/>"
    return f'<ssd:Connector name="{name}" kind="{kind}">{inner}</ssd:Connector>'


def component(name: str, file: str, connectors: str, more: str = "", attributes: str = "") -> str:
    name = name.replace("&", "&amp;").replace(">", "&gt;")
    head = f'<ssd:Component name="{name}" source="{file}" {attributes}>'
    return f"{head}<ssd:Connectors>{connectors}</ssd:Connectors>{more}</ssd:Component>"


def wire(start: str, end: str, more: str = "", attributes: str = "") -> str:
    """Ends as element/connector, or a connector of the system."""

    def side(text: str, which: str) -> str:
        element, slash, name = text.rpartition("/")
        owner = f'{which}Element="{element.replace(">", "&gt;")}" ' if slash else ""
        return f'{owner}{which}Connector="{name}"'

    return f"<ssd:Connection {side(start, 'start')} {side(end, 'end')} {attributes}>{more}</ssd:Connection>"


def parameters(text: str, units: str = "", version: str = "1.0") -> str:
    units = f"<ssv:Units>{units}</ssv:Units>" if units else ""
    head = f'<ssv:ParameterSet version="{version}" name="p" {SPACES}>'
    return f"{head}<ssv:Parameters>{text}</ssv:Parameters>{units}</ssv:ParameterSet>"


def parameter(name: str, value: object, kind: str = "Real", unit: str = "") -> str:
    unit = f' unit="{unit}"' if unit else ""
    return f'<ssv:Parameter name="{name}"><ssv:{kind} value="{value}"{unit}/></ssv:Parameter>'


def binding(source: str, inner: str = "", attributes: str = "") -> str:
    head = f'<ssd:ParameterBinding source="{source}" {attributes}>'
    return f"<ssd:ParameterBindings>{head}{inner}</ssd:ParameterBinding></ssd:ParameterBindings>"


def system(elements: str, connections: str = "", connectors: str = "", more: str = "", tail: str = "") -> str:
    connectors = f"<ssd:Connectors>{connectors}</ssd:Connectors>" if connectors else ""
    connections = f"<ssd:Connections>{connections}</ssd:Connections>" if connections else ""
    return f"{connectors}{more}<ssd:Elements>{elements}</ssd:Elements>{connections}{tail}"


def ssd(content: str, version: str = "1.0", stop: str = ' stopTime="1"', attributes: str = "") -> str:
    head = f'<ssd:SystemStructureDescription version="{version}" name="s" {SPACES}>'
    root = f'<ssd:System name="root" {attributes}>{content}</ssd:System>'
    units = f"<ssd:Units>{UNITS}</ssd:Units>"
    return f"{head}{root}{units}<ssd:DefaultExperiment{stop}/></ssd:SystemStructureDescription>"


class Reader:
    """Writes archives into a folder and reads them."""

    def __init__(self, folder: Path, fmus: Mapping[str, bytes]) -> None:
        self.folder, self.fmus = folder, fmus

    def __call__(
        self,
        text: str | bytes,
        files: Mapping[str, str | bytes] | None = None,
        name: str = "s.ssp",
        separator: str = "/",
        overrides: tuple[str, ...] = (),
    ) -> tca.Scene:
        path = self.folder / name
        own = {f"resources/{file}": content for file, content in self.fmus.items()}
        with zipfile.ZipFile(path, "w") as archive:
            for entry, content in {"SystemStructure.ssd": text, **own, **(files or {})}.items():
                info = zipfile.ZipInfo("x")
                info.filename = entry.replace("/", separator)
                archive.writestr(info, content)
        return read(path, overrides, cached_archive)


@pytest.fixture
def reading(tmp_path: Path, fmus: dict[str, bytes]) -> Reader:
    return Reader(tmp_path, fmus)


SOURCE = component("src", "resources/src.fmu", connector("y", "output"))
TARGET = component("dst", "resources/dst.fmu", connector("u", "input"))
PAIR = SOURCE + TARGET
WIRE = wire("src/y", "dst/u")


def pair(source: str = "", target: str = "", more: str = "") -> str:
    """The two components with units of their connectors."""
    return component("src", "resources/src.fmu", connector("y", "output", source)) + component(
        "dst", "resources/dst.fmu", connector("u", "input", target) + connector("p", "parameter", target), more
    )


def transformation(scene: tca.Scene) -> tuple[float, float]:
    [connection] = scene.connections
    assert connection.source[1] == "y"
    assert connection.target[1] == "u"
    return connection.factor, connection.offset


SCALED = '<ssc:LinearTransformation factor="2" offset="3"/>'


@pytest.mark.parametrize(
    ("units", "connection", "expected"),
    [
        (("", ""), WIRE, (1, 0)),
        (("m", "mm"), WIRE, (1000, 0)),
        (("mm", ""), WIRE, (1, 0)),
        (("degC", "K"), WIRE, (1, 273.15)),
        (("m", "mm"), wire("src/y", "dst/u", attributes='suppressUnitConversion="true"'), (1, 0)),
        (("m", "mm"), wire("src/y", "dst/u", SCALED), (2000, 3)),  # after the conversion: SSP 1.0, 5.1.2
        (("m", "mm"), wire("src/y", "dst/u", SCALED, 'suppressUnitConversion="true"'), (2, 3)),
        (("", ""), wire("dst/u", "src/y", SCALED), (2, 3)),  # the kinds decide on the direction
    ],
)
def test_connections_convert_units(
    units: tuple[str, str], connection: str, expected: tuple[float, float], reading: Reader
) -> None:
    assert transformation(reading(ssd(system(pair(*units), connection)))) == pytest.approx(expected)


def test_a_run_receives_converted_values(reading: Reader) -> None:
    scene = reading(ssd(system(pair("m", "mm"), wire("src/y", "dst/u", SCALED))), overrides=HELD)
    result = tca.run(scene)
    assert result["dst.u"].to_numpy() == pytest.approx(2003.0)
    assert result["dst.y"].to_numpy() == pytest.approx(9003.0)
    assert str(scene.connections[0]) == "src.y * 2000 + 3 -> dst.u"


HELD = ("coupling.exchange=held", "coupling.waveform=held")


def test_units_that_do_not_fit_are_refused(reading: Reader) -> None:
    with pytest.raises(tca.SceneError, match=r"Connection src\.y to dst\.u: units differ: 'm' \(m\) and 'K' \(K\)"):
        reading(ssd(system(pair("m", "K"), WIRE)))


def test_the_units_of_fmus_and_of_connectors_meet(reading: Reader) -> None:
    """K at the connectors of an FMU in degC: each end is converted to what the FMU has."""
    warm = component("warm", "resources/celsius.fmu", connector("u", "input", "K") + connector("y", "output", "K"))
    scene = reading(ssd(system(pair("K") + warm, wire("src/y", "warm/u") + wire("warm/y", "dst/u"))))
    found = {c.source[0]: (c.factor, c.offset) for c in scene.connections}
    assert found["src"] == pytest.approx((1.0, -273.15))
    assert found["warm"] == pytest.approx((1.0, 273.15))


@pytest.mark.parametrize(
    ("value", "connector_unit", "expected"),
    [
        (parameter("p", 3), "", 3),
        (parameter("p", 3, "Integer"), "", 3),
        (parameter("p", 2, unit="kPa"), "Pa", 2000),
        (parameter("p", 2, unit="kPa"), "", 2),
        (parameter("p", 2), "Pa", 2),
        (parameter("n", "4.0"), "", 4),
    ],
)
def test_parameters_convert_units(value: str, connector_unit: str, expected: float, reading: Reader) -> None:
    files = {"resources/p.ssv": parameters(value, UNITS)}
    scene = reading(ssd(system(pair("", connector_unit, binding("resources/p.ssv")), "")), files)
    name = "n" if 'name="n"' in value else "p"
    assert scene.member("dst").value(name) == expected


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


def mapping(entries: str) -> str:
    return (
        f'<ssd:ParameterMapping><ssm:ParameterMapping version="1.0" {SPACES}>{entries}</ssm:ParameterMapping>'
        "</ssd:ParameterMapping>"
    )


@pytest.mark.parametrize(
    ("entry", "value", "unit", "expected"),
    [
        ('<ssm:MappingEntry source="a" target="p"/>', parameter("a", 2), "", 2),
        (f'<ssm:MappingEntry source="a" target="p">{SCALED}</ssm:MappingEntry>', parameter("a", 2), "", 7),
        (
            f'<ssm:MappingEntry source="a" target="p">{SCALED}</ssm:MappingEntry>',
            parameter("a", 2, unit="kPa"),
            "Pa",
            4003,
        ),
        (
            f'<ssm:MappingEntry source="a" target="p" suppressUnitConversion="true">{SCALED}</ssm:MappingEntry>',
            parameter("a", 2, unit="kPa"),
            "Pa",
            7,
        ),
        (
            '<ssm:MappingEntry source="a" target="n"><ssc:IntegerMappingTransformation><ssc:MapEntry source="2" '
            'target="5"/></ssc:IntegerMappingTransformation></ssm:MappingEntry>',
            parameter("a", 2, "Integer"),
            "",
            5,
        ),
    ],
)
def test_mappings(entry: str, value: str, unit: str, expected: float, reading: Reader) -> None:
    files = {"p.ssv": parameters(value, UNITS)}
    scene = reading(ssd(system(pair("", unit, binding("p.ssv", mapping(entry))))), files)
    name = "n" if 'target="n"' in entry else "p"
    assert scene.member("dst").value(name) == pytest.approx(expected)


def test_what_a_mapping_leaves_out_is_named(reading: Reader) -> None:
    files = {"p.ssv": parameters(parameter("a", 2) + parameter("b", 3))}
    entry = '<ssm:MappingEntry source="a" target="p"/>'
    with pytest.warns(tca.SceneWarning, match=r"parameter b \(not in the parameter mapping\); ignored"):
        reading(ssd(system(pair("", "", binding("p.ssv", mapping(entry))))), files)


def test_values_of_version_2(reading: Reader) -> None:
    files = {"p.ssv": parameters(parameter("p", 2, "Float64") + parameter("n", 3, "Int32"), version="2.0")}
    step = '<oms:SimulationInformation name="oms_ma_default" method="oms_ma" fixedStepSize="0.25"/>'
    text = ssd(system(pair("", "", binding("p.ssv")), WIRE, tail=OMS.format(step)), version="2.0")
    scene = reading(text, files)
    assert (scene.member("dst").value("p"), scene.member("dst").value("n")) == (2.0, 3)
    assert scene.coupling.macro_step == 0.25
    array = TARGET.replace("<ssc:Real/>", '<ssc:Real/><ssd:Dimension size="3"/>')
    with pytest.raises(tca.SceneError, match=r"arrays of SSP 2\.0 are not supported; write one connector"):
        reading(ssd(system(SOURCE + array), version="2.0"))


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
        (system(SOURCE.replace("resources/src.fmu", "resources/src.ssp")), "is not in the archive"),
    ],
)
def test_systems_without_a_meaning_are_refused(content: str, problem: str, reading: Reader) -> None:
    with pytest.raises(tca.SceneError, match=problem):
        reading(ssd(content))


def test_a_shared_parameter_file_gives_each_component_its_own(reading: Reader) -> None:
    files = {"all.ssv": parameters(parameter("k", 2) + parameter("p", 3))}
    both = component("src", "resources/src.fmu", connector("y", "output"), binding("all.ssv")) + component(
        "dst", "resources/dst.fmu", connector("u", "input"), binding("all.ssv")
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = reading(ssd(system(both, WIRE)), files)
    assert (scene.member("src").value("k"), scene.member("dst").value("p")) == (2.0, 3.0)
