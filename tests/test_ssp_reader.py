"""SSP archives as scenes: what we export runs as the scene it came from; values with units through every way that the
standard has; what is not supported refused by the name of its element."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
import tca_cosim as tca
import xarray as xr
from tca_cosim import SceneError
from tca_cosim.fmi import units
from tca_cosim.fmi.archive import find_fmu
from tca_cosim.scene import ssp_writer

SHORT = ("stop_time=2", "coupling.macro_step=0.5")
SSD = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription version="1.0" name="mine"
  xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
  xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
  xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues">
  <ssd:System name="arm" description="An arm">
    <ssd:Connectors>
      <ssd:Connector name="volts" kind="input"><ssc:Real unit="V"/></ssd:Connector>
      <ssd:Connector name="E" kind="parameter"><ssc:Real unit="Pa"/></ssd:Connector>
      <ssd:Connector name="tip" kind="output"><ssc:Real unit="m"/></ssd:Connector>
    </ssd:Connectors>
    <ssd:ParameterBindings>
      <ssd:ParameterBinding source="resources/all.ssv"/>
      <ssd:ParameterBinding prefix="rod.">
        <ssd:ParameterValues>
          <ssv:ParameterSet version="1.0" name="inline"><ssv:Parameters>
            <ssv:Parameter name="dynamic"><ssv:Boolean value="false"/></ssv:Parameter>
            <ssv:Parameter name="order"><ssv:Integer value="0"/></ssv:Parameter>
          </ssv:Parameters></ssv:ParameterSet>
        </ssd:ParameterValues>
      </ssd:ParameterBinding>
    </ssd:ParameterBindings>
    <ssd:Elements>
      <ssd:Component name="heat" source="resources/thermal.fmu">
        <ssd:Connectors>
          <ssd:Connector name="V[1]" kind="input"><ssc:Real unit="V"/></ssd:Connector>
          <ssd:Connector name="T[1]" kind="output"><ssc:Real unit="K"/></ssd:Connector>
        </ssd:Connectors>
      </ssd:Component>
      <ssd:Component name="rod" source="resources/rod.fmu" implementation="CoSimulation">
        <ssd:Connectors>
          <ssd:Connector name="T[1]" kind="input"><ssc:Real unit="K"/></ssd:Connector>
          <ssd:Connector name="body.E" kind="parameter"><ssc:Real unit="Pa"/></ssd:Connector>
          <ssd:Connector name="tip.p[1]" kind="output"><ssc:Real unit="m"/></ssd:Connector>
        </ssd:Connectors>
        <ssd:ParameterBindings>
          <ssd:ParameterBinding source="resources/own.rod.ssv"/>
        </ssd:ParameterBindings>
      </ssd:Component>
    </ssd:Elements>
    <ssd:Connections>
      <ssd:Connection startConnector="volts" endElement="heat" endConnector="V[1]"/>
      <ssd:Connection startConnector="E" endElement="rod" endConnector="body.E"/>
      <ssd:Connection startElement="heat" startConnector="T[1]" endElement="rod" endConnector="T[1]"/>
      <ssd:Connection startElement="rod" startConnector="tip.p[1]" endConnector="tip"/>
    </ssd:Connections>
  </ssd:System>
  <ssd:DefaultExperiment startTime="0" stopTime="2"/>
</ssd:SystemStructureDescription>
"""
SSV = """<?xml version="1.0" encoding="UTF-8"?>
<ssv:ParameterSet version="1.0" name="all"
  xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
  xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues">
  <ssv:Parameters>{}</ssv:Parameters>
  <ssv:Units>
    <ssc:Unit name="mV"><ssc:BaseUnit kg="1" m="2" s="-3" A="-1" factor="0.001"/></ssc:Unit>
    <ssc:Unit name="degC"><ssc:BaseUnit K="1" offset="273.15"/></ssc:Unit>
    <ssc:Unit name="kPa"><ssc:BaseUnit kg="1" m="-1" s="-2" factor="1000"/></ssc:Unit>
  </ssv:Units>
</ssv:ParameterSet>
"""
REAL = '<ssv:Parameter name="{}"><ssv:Real value="{}" unit="{}"/></ssv:Parameter>'
SETS = {
    "resources/all.ssv": SSV.format(
        REAL.format("volts", 2500, "mV") + REAL.format("heat.T_0", 20, "degC") + REAL.format("E", 40, "kPa")
    ),
    "resources/own.rod.ssv": SSV.format(
        REAL.format("body.E", 1, "kPa") + REAL.format("T_0", 20, "degC") + REAL.format("T[1]", 300, "K")
    ),
    "resources/warm.ssv": SSV.format(REAL.format("volts", 1, "V") + REAL.format("heat.T_0", 300, "K")),
    "resources/warm.rod.ssv": SSV.format(REAL.format("T_0", 300, "K")),
}


def archive(folder: Path, ssd: str = SSD, change: Callable[[dict[str, str]], object] = lambda texts: None) -> Path:
    texts = {"SystemStructure.ssd": ssd, **SETS}
    change(texts)
    path = folder / "mine.ssp"
    with zipfile.ZipFile(path, "w") as opened:
        for name, text in texts.items():
            opened.writestr(name, text)
        for name in ("thermal.fmu", "rod.fmu"):
            opened.write(find_fmu(name), f"resources/{name}")
    return path


def test_what_we_export_is_the_scene_to_the_last_bit(tmp_path: Path) -> None:
    ssp_writer.write(tmp_path / "scene.ssp")
    back = tca.run(tca.read(tmp_path / "scene.ssp", SHORT))
    scene = tca.run(tca.read("step", [*SHORT, "rod.closure=inside"]))
    assert tca.read(tmp_path / "scene.ssp").stop_time == 30.0
    xr.testing.assert_identical(back.drop_attrs(deep=False), scene.drop_attrs(deep=False))


def test_parameter_sets_of_the_archive_can_be_chosen(tmp_path: Path) -> None:
    ssp_writer.write(tmp_path / "scene.ssp")
    for name in ("literature", "measured"):
        back = tca.read(tmp_path / "scene.ssp", [f"parameters={name}"])
        scene = tca.read("step", ["rod.closure=inside", f"parameters={name}"])
        for member in scene.members:
            parameters = [v for v, variable in member.archive.variables.items() if variable.causality == "parameter"]
            assert [back.member(member.name).value(v) for v in parameters] == [member.value(v) for v in parameters]
    with pytest.raises(SceneError, match=r"parameters = 'measurd': did you mean 'measured'"):
        tca.read(tmp_path / "scene.ssp", ["parameters=measurd"])


def test_values_come_through_connectors_components_prefixes_and_units(tmp_path: Path) -> None:
    scene = tca.read(archive(tmp_path), ["coupling.macro_step=0.5"])
    assert (scene.title, scene.stop_time) == ("An arm", 2.0)
    assert [str(c) for c in scene.connections] == ["heat.T[1] -> rod.T[1]"]
    heat, rod = scene.members
    assert heat.signals["V[1]"].value == 2.5
    assert heat.value("T_0") == pytest.approx(293.15, rel=1e-15)
    assert rod.value("body.E") == 40e3  # the system's value wins over the component's own
    assert (rod.value("dynamic"), rod.value("order")) == (False, 0)
    assert "T[1]" not in rod.signals  # connected: the value was where it starts
    result = tca.run(scene)
    assert result["heat.T"][-1, 0] > 300.0
    warm = tca.read(tmp_path / "mine.ssp", ["parameters=warm"])
    assert warm.member("heat").value("T_0") == 300.0
    assert warm.member("heat").signals["V[1]"].value == 1.0


def test_a_scene_file_builds_on_an_archive(tmp_path: Path) -> None:
    archive(tmp_path)
    text = 'title = "More"\nssp = "mine.ssp"\n[heat]\n"V[1]" = "3 V"\n[coupling]\nmacro_step = 0.5\n'
    (tmp_path / "more.toml").write_text(text)
    scene = tca.read(tmp_path / "more.toml")
    assert (scene.title, scene.stop_time, scene.coupling.macro_step) == ("More", 2.0, 0.5)
    assert scene.member("heat").signals["V[1]"].value == 3.0
    assert scene.member("heat").value("T_0") == pytest.approx(293.15)
    (tmp_path / "more.toml").write_text('ssp = "other.ssp"\n')
    with pytest.raises(SceneError, match=r"more\.toml:1: ssp = 'other\.ssp': no such file"):
        tca.read(tmp_path / "more.toml")


SIGNALS = '<ssd:SignalDictionaries><ssd:SignalDictionary name="dict" type="x"/></ssd:SignalDictionaries>'
TABLE = (
    '<ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/></ssc:BooleanMappingTransformation>'
)
MAPPED = '<ssd:ParameterMapping source="resources/a.ssm"/>'


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('endConnector="T[1]"/>', f'endConnector="T[1]">{TABLE}</ssd:Connection>', "MappingTransformation T[1]: not"),
        ("</ssd:Connections>", f"</ssd:Connections>{SIGNALS}", "SignalDictionary dict: type 'x'"),
        ('all.ssv"/>', f'all.ssv">{MAPPED}</ssd:ParameterBinding>', "source 'resources/a.ssm' is not in the archive"),
        ('endConnector="T[1]"/>', 'endConnector="T[9]"/>', "Connector rod.T[9]: no such variable; did you mean 'T["),
        ('endElement="heat"', 'endElement="heet"', "no such element; did you mean 'heat'"),
        ('endConnector="tip"', 'endConnector="top"', "no such connector; did you mean 'tip'"),
        ('startConnector="volts"', 'startConnector="tip"', "both are inputs; connect an output to an input"),
        ('version="1.0" name="mine"', 'version="3.0" name="mine"', "version '3.0' is not supported; allowed: 1.0"),
        ('<ssv:Integer value="0"/>', '<ssv:Binary value="0"/>', "Binary"),
        ('"CoSimulation"', '"ModelExchange"', "Component rod: implementation ModelExchange"),
        ('source="resources/thermal.fmu"', 'source="resources/cold.fmu"', "Component heat: source 'resources"),
        ('name="heat" source', 'name="heat" type="application/x-ssp-package" source', "is no FMU; put an SSP"),
        ('source="resources/all.ssv"', 'source="resources/none.ssv"', "ParameterBinding of arm: source"),
        ('source="resources/all.ssv"', 'sourceBase="component" source="resources/all.ssv"', "sourceBase"),
        ('startTime="0"', 'startTime="3"', "start_time = 3.0: not before the stop time, 2 s"),
        ('kind="output"', 'kind="outlet"', "SystemStructure.ssd: is not valid SSP 1.0"),
        ('startConnector="T[1]"', 'startConnector="E_stored"', "units differ: 'J' (kg.m2.s-2) and 'K' (K)"),
        ('Integer value="0"', 'Integer value="9"', "rod.order = 9: out of range"),
    ],
)  # fmt: skip
def test_what_is_not_supported_is_refused_by_name(old: str, new: str, said: str, tmp_path: Path) -> None:
    assert old in SSD
    with pytest.raises(SceneError) as caught:
        tca.read(archive(tmp_path, SSD.replace(old, new)))
    assert said in str(caught.value)
    assert "mine.ssp" in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name="order"', 'name="ordre"', r"parameter rod.ordre \(did you mean 'order'\?\); ignored"),
        ('prefix="rod."', 'prefix="rot."', r"parameter rot.dynamic \(did you mean 'rod'\?\), rot.order"),
    ],
)
def test_parameters_without_a_variable_are_ignored_with_a_warning(
    old: str, new: str, said: str, tmp_path: Path
) -> None:
    """As SSP 1.0 has it; one parameter file may serve many systems."""
    with pytest.warns(tca.SceneWarning, match=said):
        scene = tca.read(archive(tmp_path, SSD.replace(old, new)))
    assert scene.member("rod").value("order") == 4


@pytest.mark.parametrize(
    ("unit", "said"),
    [("kPa", "'kPa' .* and 'K' .* do not measure the same quantity"), ("mK", "'mK' has no definition by base units")],
)
def test_units_of_values_are_checked(unit: str, said: str, tmp_path: Path) -> None:
    bad = {"resources/own.rod.ssv": SSV.format(REAL.format("T_0", 20, unit))}
    with pytest.raises(SceneError, match=f"Parameter rod.T_0: units differ: .*{said}"):
        tca.read(archive(tmp_path, change=lambda texts: texts.update(bad)))


def test_units_with_a_factor_or_an_offset_of_their_own() -> None:
    """As an FMU may declare them: value in SI base units = factor * value + offset."""
    volt = {"kg": 1, "m": 2, "s": -3, "A": -1}
    assert units.convert("3 V", volt, "mV", factor=1e-3) == pytest.approx(3000.0)
    assert units.convert("300 K", {"K": 1}, "degC", offset=273.15) == pytest.approx(26.85)
    assert units.convert("5 K", {"K": 1}, "degC", difference=True, offset=273.15) == pytest.approx(5.0)


def test_what_is_no_archive_says_so(tmp_path: Path) -> None:
    (tmp_path / "mine.ssp").write_text("nothing")
    with pytest.raises(SceneError, match="not a readable SSP archive"):
        tca.read(tmp_path / "mine.ssp")
    with zipfile.ZipFile(tmp_path / "mine.ssp", "w") as opened:
        opened.writestr("readme.txt", "nothing")
    with pytest.raises(SceneError, match=r"SystemStructure\.ssd: is not in the archive"):
        tca.read(tmp_path / "mine.ssp")
