"""The SSP archive: valid to the standard's schemas and complete. test_hosts.py has it run by other makers' masters."""

from __future__ import annotations

import zipfile
from pathlib import Path

import fmpy.ssp.ssd as fmpy_ssd
import pytest
import tca_cosim as tca
from lxml import etree
from tca_cosim.scene import ssp_writer

SETS = ("fig3", "literature", "paper_literal", "measured")
VOLTS = (0.0, 1.5, 3.0)


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ssp") / "scene.ssp"
    ssp_writer.write(path)
    return path


def parameters(archive: Path, name: str, member: str) -> dict[str, fmpy_ssd.Parameter]:
    """By name; the file is checked against the schema."""
    actual = fmpy_ssd.read_ssv(str(archive), resource=f"resources/{name}.{member}.ssv")
    assert actual.name == name
    return {parameter.name: parameter for parameter in actual.parameters}


def test_it_holds_everything(archive: Path) -> None:
    with zipfile.ZipFile(archive) as opened:
        names = set(opened.namelist())
    members = ("thermal", "rod")
    sets = {f"resources/{name}.{member}.ssv" for name in SETS for member in members}
    assert names == {"SystemStructure.ssd"} | sets | {f"resources/{member}.fmu" for member in members}


def test_every_real_parameter_has_a_value_and_others_where_they_are_set(archive: Path) -> None:
    """A host without the FMU's start values at hand gets the whole model."""
    scene = tca.read("step")
    for member in scene.members:
        actual = parameters(archive, "fig3", member.name)
        declared = [v for v in member.archive.variables.values() if v.causality == "parameter"]
        assert {v.name for v in declared if v.type == "Real"} <= set(actual)
        assert {v.name for v in declared if v.type != "Real"} & set(actual) <= set(member.parameters)


def test_the_structure_is_valid_and_wired(archive: Path) -> None:
    described = fmpy_ssd.read_ssd(str(archive))  # checks it against the schema, and the bound parameter sets
    system = described.system
    wired = {(c.startElement, c.startConnector, c.endElement, c.endConnector) for c in system.connections}
    assert wired == {("thermal", f"T[{k}]", "rod", f"T[{k}]") for k in (1, 2, 3)}
    assert system.connectors == []
    kinds = {}
    for component in system.elements:
        assert component.type == "application/x-fmu-sharedlibrary"
        [binding] = component.parameterBindings
        assert binding.source == f"resources/fig3.{component.name}.ssv"
        kinds[component.name] = {connector.name: connector.kind for connector in component.connectors}
    shown = {f"tip.{name}[{k}]" for name in ("p", "euler") for k in (1, 2, 3)}
    heat = {f"T[{k}]" for k in (1, 2, 3)}
    assert kinds == {
        "thermal": dict.fromkeys(heat, "output"),
        "rod": {**dict.fromkeys(heat, "input"), **dict.fromkeys(shown, "output")},
    }
    units = {unit.name: unit for unit in described.units}
    assert set(units) == {"K", "m", "rad"}
    assert (units["m"].m, units["m"].s, units["K"].K) == (1, 0, 1)


def test_omsimulator_finds_its_settings(archive: Path) -> None:
    """The current release reads attributes, older ones a child; neither reads more of a component."""
    with zipfile.ZipFile(archive) as opened:
        root = etree.fromstring(opened.read("SystemStructure.ssd"))
    [system, experiment] = root.findall(".//{*}SimulationInformation")
    settings = {"name": "oms_ma_default", "method": "oms_ma", "fixedStepSize": "0.1", "relativeTolerance": "1e-06"}
    assert dict(system.attrib) == settings
    [older] = system
    assert etree.QName(older).localname == "FixedStepMaster"
    assert (older.get("stepSize"), older.get("relativeTolerance")) == ("0.1", "1e-06")
    assert set(experiment.attrib) == {"resultFile", "loggingInterval", "bufferSize"}
    assert root.findall(".//{*}Component/{*}Annotations") == []


def test_tolerances_of_the_sets_are_not_looser_than_the_annotation(archive: Path) -> None:
    with zipfile.ZipFile(archive) as opened:
        root = etree.fromstring(opened.read("SystemStructure.ssd"))
    tolerance = float(root.find(".//{*}SimulationInformation").get("relativeTolerance"))
    for name in SETS:
        own = [float(parameters(archive, name, member)["tolerance"].value) for member in ("thermal", "rod")]
        assert min(own) == tolerance


def test_scaled_connections_and_odd_names_come_back(tmp_path: Path) -> None:
    """A factor is written as a linear transformation, without a second conversion of units."""
    entry = {"from": "thermal.T[1]", "to": "rod.T[1]", "factor": 0.5, "offset": 150.0}
    scene = {"stop_time": 1.0, "connections": [entry], "rod": {"closure": "inside"}, "thermal": {"V": [0, 1, 2]}}
    ssp_writer.write_scene(tmp_path / "s.ssp", tca.read(scene))
    back = tca.read(tmp_path / "s.ssp")
    assert [(c.factor, c.offset) for c in back.connections] == [(0.5, 150.0)]


@pytest.mark.parametrize("name", SETS)
def test_parameter_sets_are_the_scenes_ones(archive: Path, name: str) -> None:
    scene = tca.read("step", [f"parameters={name}", "rod.closure=inside"])
    actual = {member.name: parameters(archive, name, member.name) for member in scene.members}
    for member in scene.members:
        for variable in member.archive.variables.values():
            if variable.causality == "parameter" and variable.type == "Real":
                parameter = actual[member.name][variable.name]
                assert float(parameter.value) == member.value(variable.name)
                assert parameter.unit == variable.unit
    assert (actual["rod"]["dynamic"].type, actual["rod"]["dynamic"].value) == ("Boolean", "false")
    assert [float(actual["thermal"][f"V[{k}]"].value) for k in (1, 2, 3)] == list(VOLTS)
    assert ("tca.law" in actual["rod"]) == (name == "measured")


def test_signals_that_vary_are_refused(tmp_path: Path) -> None:
    with pytest.raises(tca.SceneError, match=r"thermal.V\[1\] varies in time; .* constants"):
        ssp_writer.write(tmp_path / "sine.ssp", "sine")
    assert not (tmp_path / "sine.ssp").exists()
