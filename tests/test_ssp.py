"""The SSP archive: valid to the standard's schemas, complete, and run by FMPy's SSP master beside ours."""

from __future__ import annotations

import zipfile
from pathlib import Path

import fmpy.ssp.ssd as fmpy_ssd
import numpy as np
import pytest
from fmpy.ssp import simulation

import orchestration as tca
from orchestration import ssp

VOLTS = (0.0, 1.5, 3.0)
TIP = [f"rod.tip.p[{k}]" for k in (1, 2, 3)]
HEAT = [f"thermal.T[{k}]" for k in (1, 2, 3)]


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ssp") / "scene.ssp"
    ssp.write(path)
    return path


def parameters(archive: Path, name: str) -> fmpy_ssd.ParameterSet:
    """Checked against the schema. FMPy takes the text 'false' for true, so Booleans are read here."""
    found = fmpy_ssd.read_ssv(str(archive), resource=f"resources/{name}.ssv")
    for parameter in found.parameters:
        if parameter.type == "Boolean":
            parameter.value = parameter.value == "true"
    return found


def test_it_holds_everything(archive: Path) -> None:
    with zipfile.ZipFile(archive) as opened:
        names = set(opened.namelist())
    sets = {"fig3", "literature", "paper_literal", "measured"}
    fmus = {"resources/thermal.fmu", "resources/rod.fmu"}
    assert names == {"SystemStructure.ssd"} | fmus | {f"resources/{name}.ssv" for name in sets}


def test_the_structure_is_valid_and_wired(archive: Path) -> None:
    described = fmpy_ssd.read_ssd(str(archive))  # checks it against the schema, and the bound parameter set
    system = described.system
    assert [binding.source for binding in system.parameterBindings] == ["resources/fig3.ssv"]
    wired = {(c.startElement, c.startConnector, c.endElement, c.endConnector) for c in system.connections}
    for k in (1, 2, 3):
        assert ("thermal", f"T[{k}]", "rod", f"T[{k}]") in wired
        assert (None, f"V[{k}]", "thermal", f"V[{k}]") in wired
        assert ("rod", f"tip.p[{k}]", None, f"tip.p[{k}]") in wired
    kinds = {connector.name: connector.kind for connector in system.connectors}
    assert {name for name, kind in kinds.items() if kind == "input"} == {"V[1]", "V[2]", "V[3]"}
    assert {"T[1]", "tip.p[3]", "tip.euler[2]"} <= kinds.keys()
    units = {unit.name: unit for unit in described.units}
    assert (units["V"].kg, units["V"].m, units["V"].s, units["V"].A) == (1, 2, -3, -1)


@pytest.mark.parametrize("name", ["fig3", "literature", "paper_literal", "measured"])
def test_parameter_sets_are_the_scenes_ones(archive: Path, name: str) -> None:
    found = {parameter.name: parameter for parameter in parameters(archive, name).parameters}
    scene = tca.read("step", [f"parameters={name}", "rod.closure=inside"])
    for member in scene.members:
        for variable in member.archive.variables.values():
            if variable.causality == "parameter" and variable.type == "Real":
                parameter = found[f"{member.name}.{variable.name}"]
                assert float(parameter.value) == member.value(variable.name)
                assert parameter.unit == variable.unit
    assert found["rod.dynamic"].value is False
    assert [float(found[f"V[{k}]"].value) for k in (1, 2, 3)] == list(VOLTS)
    assert ("rod.tca.law" in found) == (name == "measured")


def start_connectors(component: fmpy_ssd.Component, *about: object) -> None:
    """FMPy starts all connectors at 0, and the rod would find absolute zero in its first step: here they start at what
    the FMUs say."""
    instantiate(component, *about)
    for connector in component.connectors:
        connector.value = simulation.get_value(component, connector.name)


instantiate = simulation.instantiate_fmu


@pytest.fixture(scope="module")
def runs(archive: Path) -> dict[float, tuple[np.ndarray, ...]]:
    """For two steps [s]: FMPy's T [K] and tip [m], and our master's; a row per macro step."""
    volts = {f"V[{k}]": (lambda time, value=value: value) for k, value in enumerate(VOLTS, 1)}
    found = {}
    for h in (0.1, 0.05):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(simulation, "instantiate_fmu", start_connectors)
            theirs = simulation.simulate_ssp(
                str(archive), stop_time=4.0 - h / 2, step_size=h, parameter_set=parameters(archive, "fig3"), input=volts
            )
        scene = tca.read("step", ["rod.closure=inside", "stop_time=4", f"coupling.macro_step={h}"])
        ours = tca.run(scene)
        T, tip = (np.stack([theirs[name] for name in names], axis=1) for names in (HEAT, TIP))
        found[h] = (T, tip, ours["thermal.T"].to_numpy(), ours["rod.tip.p"].to_numpy())
    return found


def test_fmpy_runs_it_to_its_coupling_order(runs: dict[float, tuple[np.ndarray, ...]]) -> None:
    """Row k of FMPy is the state at (k + 1) h. Its connections hand on values a step late: voltages arrive at h, and
    the rod sees the temperature of one step before. First order: the difference at one time, 1.4 K and 1.0 mm for steps
    of 0.1 s, halves with the step."""
    heat, shape = {}, {}
    for h, (T, tip, our_T, our_tip) in runs.items():
        n = len(T)
        heat[h] = np.abs(T - our_T[1 : n + 1]).max()
        shape[h] = np.abs(tip[2:] - our_tip[3 : n + 1]).max()
        assert np.abs(T - our_T[:n]).max() < 1e-10  # [K] the lag alone is the difference
        assert np.abs(tip[2:] - our_tip[1 : n - 1]).max() < 1e-10  # [m]
    assert heat[0.1] / heat[0.05] == pytest.approx(2.0, rel=0.1)
    assert shape[0.1] / shape[0.05] == pytest.approx(2.0, rel=0.2)
