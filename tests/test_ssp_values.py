"""SSP archives of foreign FMUs: units of connectors, parameter files, mappings and linear transformations."""

from __future__ import annotations

import warnings

import pytest
import ssp_maker as ssp
import tca_cosim as tca
from ssp_maker import Reader


def transformation(scene: tca.Scene) -> tuple[float, float]:
    [connection] = scene.connections
    assert connection.source[1] == "y"
    assert connection.target[1] == "u"
    return connection.factor, connection.offset


@pytest.mark.parametrize(
    ("units", "connection", "expected"),
    [
        (("", ""), ssp.WIRE, (1, 0)),
        (("m", "mm"), ssp.WIRE, (1000, 0)),
        (("mm", ""), ssp.WIRE, (1, 0)),
        (("degC", "K"), ssp.WIRE, (1, 273.15)),
        (("m", "mm"), ssp.wire("src/y", "dst/u", attributes='suppressUnitConversion="true"'), (1, 0)),
        (("m", "mm"), ssp.wire("src/y", "dst/u", ssp.SCALED), (2000, 3)),  # after the conversion: SSP 1.0, 5.1.2
        (("m", "mm"), ssp.wire("src/y", "dst/u", ssp.SCALED, 'suppressUnitConversion="true"'), (2, 3)),
        (("", ""), ssp.wire("dst/u", "src/y", ssp.SCALED), (2, 3)),  # the kinds decide on the direction
    ],
)
def test_connections_convert_units(
    units: tuple[str, str], connection: str, expected: tuple[float, float], reading: Reader
) -> None:
    assert transformation(reading(ssp.ssd(ssp.system(ssp.pair(*units), connection)))) == pytest.approx(expected)


def test_a_run_receives_converted_values(reading: Reader) -> None:
    scene = reading(
        ssp.ssd(ssp.system(ssp.pair("m", "mm"), ssp.wire("src/y", "dst/u", ssp.SCALED))), overrides=ssp.HELD
    )
    result = tca.run(scene)
    assert result["dst.u"].to_numpy() == pytest.approx(2003.0)
    assert result["dst.y"].to_numpy() == pytest.approx(9003.0)
    assert str(scene.connections[0]) == "src.y * 2000 + 3 -> dst.u"


def test_units_that_do_not_fit_are_refused(reading: Reader) -> None:
    with pytest.raises(tca.SceneError, match=r"Connection src\.y to dst\.u: units differ: 'm' \(m\) and 'K' \(K\)"):
        reading(ssp.ssd(ssp.system(ssp.pair("m", "K"), ssp.WIRE)))


def test_the_units_of_fmus_and_of_connectors_meet(reading: Reader) -> None:
    """K at the connectors of an FMU in degC: each end is converted to what the FMU has."""
    warm = ssp.component(
        "warm", "resources/celsius.fmu", ssp.connector("u", "input", "K") + ssp.connector("y", "output", "K")
    )
    scene = reading(
        ssp.ssd(ssp.system(ssp.pair("K") + warm, ssp.wire("src/y", "warm/u") + ssp.wire("warm/y", "dst/u")))
    )
    actual = {c.source[0]: (c.factor, c.offset) for c in scene.connections}
    assert actual["src"] == pytest.approx((1.0, -273.15))
    assert actual["warm"] == pytest.approx((1.0, 273.15))


@pytest.mark.parametrize(
    ("value", "connector_unit", "expected"),
    [
        (ssp.parameter("p", 3), "", 3),
        (ssp.parameter("p", 3, "Integer"), "", 3),
        (ssp.parameter("p", 2, unit="kPa"), "Pa", 2000),
        (ssp.parameter("p", 2, unit="kPa"), "", 2),
        (ssp.parameter("p", 2), "Pa", 2),
        (ssp.parameter("n", "4.0"), "", 4),
    ],
)
def test_parameters_convert_units(value: str, connector_unit: str, expected: float, reading: Reader) -> None:
    files = {"resources/p.ssv": ssp.parameters(value, ssp.UNITS)}
    scene = reading(ssp.ssd(ssp.system(ssp.pair("", connector_unit, ssp.binding("resources/p.ssv")), "")), files)
    name = "n" if 'name="n"' in value else "p"
    assert scene.member("dst").value(name) == expected


def mapping(entries: str) -> str:
    return (
        f'<ssd:ParameterMapping><ssm:ParameterMapping version="1.0" {ssp.SPACES}>{entries}</ssm:ParameterMapping>'
        "</ssd:ParameterMapping>"
    )


@pytest.mark.parametrize(
    ("entry", "value", "unit", "expected"),
    [
        ('<ssm:MappingEntry source="a" target="p"/>', ssp.parameter("a", 2), "", 2),
        (f'<ssm:MappingEntry source="a" target="p">{ssp.SCALED}</ssm:MappingEntry>', ssp.parameter("a", 2), "", 7),
        (
            f'<ssm:MappingEntry source="a" target="p">{ssp.SCALED}</ssm:MappingEntry>',
            ssp.parameter("a", 2, unit="kPa"),
            "Pa",
            4003,
        ),
        (
            f'<ssm:MappingEntry source="a" target="p" suppressUnitConversion="true">{ssp.SCALED}</ssm:MappingEntry>',
            ssp.parameter("a", 2, unit="kPa"),
            "Pa",
            7,
        ),
        (
            '<ssm:MappingEntry source="a" target="n"><ssc:IntegerMappingTransformation><ssc:MapEntry source="2" '
            'target="5"/></ssc:IntegerMappingTransformation></ssm:MappingEntry>',
            ssp.parameter("a", 2, "Integer"),
            "",
            5,
        ),
    ],
)
def test_mappings(entry: str, value: str, unit: str, expected: float, reading: Reader) -> None:
    files = {"p.ssv": ssp.parameters(value, ssp.UNITS)}
    scene = reading(ssp.ssd(ssp.system(ssp.pair("", unit, ssp.binding("p.ssv", mapping(entry))))), files)
    name = "n" if 'target="n"' in entry else "p"
    assert scene.member("dst").value(name) == pytest.approx(expected)


@pytest.mark.parametrize(("spelt", "expected"), [("1", False), ("true", False), ("0", True), ("false", True)])
def test_mappings_of_booleans_take_both_spellings(spelt: str, expected: bool, reading: Reader) -> None:
    entries = '<ssc:MapEntry source="true" target="false"/><ssc:MapEntry source="0" target="1"/>'
    table = f"<ssc:BooleanMappingTransformation>{entries}</ssc:BooleanMappingTransformation>"
    entry = f'<ssm:MappingEntry source="a" target="on">{table}</ssm:MappingEntry>'
    files = {"p.ssv": ssp.parameters(ssp.parameter("a", spelt, "Boolean"))}
    source = ssp.component(
        "src", "resources/src.fmu", ssp.connector("y", "output"), ssp.binding("p.ssv", mapping(entry))
    )
    assert reading(ssp.ssd(ssp.system(source + ssp.TARGET, ssp.WIRE)), files).member("src").value("on") is expected


def test_what_a_mapping_leaves_out_is_named(reading: Reader) -> None:
    files = {"p.ssv": ssp.parameters(ssp.parameter("a", 2) + ssp.parameter("b", 3))}
    entry = '<ssm:MappingEntry source="a" target="p"/>'
    with pytest.warns(tca.SceneWarning, match=r"parameter b \(not in the parameter mapping\); ignored"):
        reading(ssp.ssd(ssp.system(ssp.pair("", "", ssp.binding("p.ssv", mapping(entry))))), files)


def test_values_of_version_2(reading: Reader) -> None:
    files = {"p.ssv": ssp.parameters(ssp.parameter("p", 2, "Float64") + ssp.parameter("n", 3, "Int32"), version="2.0")}
    step = '<oms:SimulationInformation name="oms_ma_default" method="oms_ma" fixedStepSize="0.25"/>'
    text = ssp.ssd(
        ssp.system(ssp.pair("", "", ssp.binding("p.ssv")), ssp.WIRE, tail=ssp.OMS.format(step)), version="2.0"
    )
    scene = reading(text, files)
    assert (scene.member("dst").value("p"), scene.member("dst").value("n")) == (2.0, 3)
    assert scene.coupling.macro_step == 0.25
    array = ssp.TARGET.replace("<ssc:Real/>", '<ssc:Real/><ssd:Dimension size="3"/>')
    with pytest.raises(tca.SceneError, match=r"arrays of SSP 2\.0 are not supported; write one connector"):
        reading(ssp.ssd(ssp.system(ssp.SOURCE + array), version="2.0"))


def test_a_shared_parameter_file_gives_each_component_its_own(reading: Reader) -> None:
    files = {"all.ssv": ssp.parameters(ssp.parameter("k", 2) + ssp.parameter("p", 3))}
    both = ssp.component(
        "src", "resources/src.fmu", ssp.connector("y", "output"), ssp.binding("all.ssv")
    ) + ssp.component("dst", "resources/dst.fmu", ssp.connector("u", "input"), ssp.binding("all.ssv"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = reading(ssp.ssd(ssp.system(both, ssp.WIRE)), files)
    assert (scene.member("src").value("k"), scene.member("dst").value("p")) == (2.0, 3.0)
