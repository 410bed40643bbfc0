"""The .fmu files themselves: valid to FMPy, self-contained, exact about dependencies, honest about what they can."""

from __future__ import annotations

import re
import subprocess
import zipfile
from pathlib import Path

import fmpy
import pytest
from fmpy.validation import validate_fmu
from fmu_host import ROOT, SUBJECTS, FMU2Host
from lxml import html

FMUS = pytest.mark.parametrize("path", [subject.path for subject in SUBJECTS], ids=lambda path: path.stem)
SHIPPED = pytest.mark.parametrize("path", [ROOT / "fmus/thermal.fmu", ROOT / "fmus/rod.fmu"], ids=["thermal", "rod"])
LICENSES = ("license", "third_party")
STANDARD = Path(fmpy.__file__).parent / "c-code" / "fmi2Functions.h"


@pytest.fixture
def binary(path: Path, tmp_path: Path) -> Path:
    with zipfile.ZipFile(path) as archive:
        return Path(archive.extract(f"binaries/linux64/{path.stem}.so", tmp_path))


def output_of(*command: str | Path) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


@FMUS
def test_fmpy_finds_no_problem(path: Path):
    assert validate_fmu(str(path)) == []


@FMUS
def test_the_documentation_lists_every_variable_once(path: Path):
    with zipfile.ZipFile(path) as archive:
        page = html.fromstring(archive.read("documentation/index.html"))
    lines = list(page.get_element_by_id("variables").iter("tr"))
    rows = {row[0].text_content(): [cell.text_content() for cell in row] for row in lines}
    assert len(rows) == len(lines)
    variables = fmpy.read_model_description(str(path)).modelVariables
    assert list(rows)[1:] == [variable.name for variable in variables]
    for variable in variables:
        _, causality, unit, start, _, description = rows[variable.name]
        assert description == variable.description
        assert unit == (variable.unit or "")
        allowed = {"state", "derivative"} if variable.causality == "local" else {variable.causality}
        assert causality.split(",")[0] in allowed
        assert bool(start) == (variable.start is not None)
        if variable.start is not None and variable.type == "Real":
            assert float(start) == float(variable.start)


@SHIPPED
def test_the_package_explains_itself(path: Path):
    with zipfile.ZipFile(path) as archive:
        page = archive.read("documentation/index.html").decode()
        icon = archive.read("model.png")
        licenses = {name: archive.read(f"documentation/licenses/{name}.txt").decode() for name in LICENSES}
    for heading in ("What it is", "Equations", "Symbols", "Example", "Limits", "In a host", "References", "Variables"):
        assert page.count(f"<h2>{heading}</h2>") == 1
    assert icon.startswith(b"\x89PNG\r\n\x1a\n")
    assert len(icon) < 10_000
    assert licenses["license"] == (ROOT / "LICENSE").read_text()
    assert all(name in licenses["third_party"] for name in ("Eigen", "Mozilla Public License 2.0", "SUNDIALS", "BSD 3"))


@SHIPPED
def test_the_page_has_a_drawing_equations_and_an_example_that_runs(path: Path, capsys: pytest.CaptureFixture[str]):
    with zipfile.ZipFile(path) as archive:
        page = html.fromstring(archive.read("documentation/index.html"))
    assert len(list(page.iter("svg"))) == 1
    equations, symbols, _ = page.iter("table")
    assert len(list(equations.iter("tr"))) - 1 >= 10
    names = {variable.name.split("[")[0] for variable in fmpy.read_model_description(str(path)).modelVariables}
    named = {code.text_content() for cell in symbols.xpath(".//td[2]") for code in cell.iter("code")}
    assert {name.split("[")[0] for name in named} <= names
    (example,) = page.iter("pre")
    exec(example.text_content().replace(f'"{path.name}"', repr(str(path))), {})
    assert capsys.readouterr().out


@FMUS
def test_the_description_says_who_made_it_and_when(path: Path):
    description = fmpy.read_model_description(str(path))
    assert description.author == "The tca-cosim authors"
    assert (ROOT / "LICENSE").read_text().splitlines()[2] == description.copyright
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT00:00:00Z", description.generationDateAndTime)


@FMUS
def test_exports_the_standard_functions_and_that_for_other_sizes(binary: Path):
    standard = set(re.findall(r"^\s*FMI2_Export fmi2\w+TYPE\s+(fmi2\w+);", STANDARD.read_text(), re.MULTILINE))
    exported = {line.split()[-1] for line in output_of("nm", "-D", "--defined-only", binary).splitlines()}
    assert len(standard) == 44
    assert exported == standard | {"tcaExport"}


@FMUS
def test_needs_only_a_c_library_from_2_17_on(binary: Path):
    needed = set(re.findall(r"NEEDED.*\[(.*)\]", output_of("readelf", "-d", binary)))
    assert needed <= {"libc.so.6", "libm.so.6", "libpthread.so.0", "ld-linux-x86-64.so.2"}  # all are parts of glibc
    versions = re.findall(r"Name: GLIBC_([\d.]+)", output_of("readelf", "-V", binary))
    assert versions
    assert max(tuple(int(part) for part in version.split(".")) for version in versions) <= (2, 17)


@FMUS
def test_declares_what_it_can(path: Path):
    description = fmpy.read_model_description(str(path))
    slave = description.coSimulation
    assert slave.canHandleVariableCommunicationStepSize
    assert slave.canInterpolateInputs
    assert slave.maxOutputDerivativeOrder == 1
    for interface in (slave, description.modelExchange):
        assert interface.canGetAndSetFMUstate
        assert interface.canSerializeFMUstate
        assert not interface.canBeInstantiatedOnlyOncePerProcess
        assert interface.providesDirectionalDerivative


@FMUS
def test_every_variable_is_described_and_has_its_unit(path: Path):
    description = fmpy.read_model_description(str(path))
    units = {unit.name: unit for unit in description.unitDefinitions}
    for variable in description.modelVariables:
        assert variable.description, variable.name
        if variable.type == "Real":
            assert units[variable.unit].baseUnit is not None, variable.name
        shown = {"K": "degC", "m": "mm", "rad": "deg"}.get(variable.unit)
        assert variable.displayUnit == shown, variable.name
        if variable.type == "Enumeration":
            assert [item.value for item in variable.declaredType.items] == [
                str(k + 1) for k in range(len(variable.declaredType.items))
            ]
        if variable.causality in ("parameter", "input"):
            assert variable.start is not None, variable.name


@FMUS
def test_types_and_variables_have_different_names(path: Path):
    description = fmpy.read_model_description(str(path))
    types = {declared.name for declared in description.typeDefinitions}
    assert types
    assert not types & {variable.name for variable in description.modelVariables}


@FMUS
def test_declared_dependencies_are_the_true_ones(path: Path):
    """Changing an input without a step changes only outputs that declare a dependency on it."""
    with FMU2Host(path) as fmu:
        fmu.start()
        fmu.step(0.0, 0.01)
        # FMPy gives None for an empty list of dependencies as well as for an absent one.
        declared = {
            unknown.variable.name: {known.name for known in unknown.dependencies or []}
            for unknown in fmu.description.outputs
        }
        inputs = [v for v in fmu.description.modelVariables if v.causality == "input"]
        acting: dict[str, set[str]] = {name: set() for name in fmu.outputs}
        for variable in inputs:
            [start] = fmu.getReal([variable.valueReference])
            before = fmu.read()
            fmu.write(variable.name, start + 0.125)
            after = fmu.read()
            fmu.write(variable.name, start)
            for name, a, b in zip(fmu.outputs, before, after, strict=True):
                if a != b:
                    acting[name].add(variable.name)
        undeclared = {name: actual - declared[name] for name, actual in acting.items() if actual - declared[name]}
        assert not undeclared


@FMUS
def test_every_output_lists_its_dependencies(path: Path):
    with zipfile.ZipFile(path) as archive:
        xml = archive.read("modelDescription.xml").decode()
    structure = xml[xml.index("<Outputs>") : xml.index("</Outputs>")]
    unknowns = re.findall(r"<Unknown [^>]*>", structure)
    assert unknowns
    assert all("dependencies=" in unknown for unknown in unknowns)


@FMUS
def test_a_description_of_another_build_cannot_load(path: Path):
    with FMU2Host(path) as fmu:
        good = fmu.component
        fmu.guid = "{00000000-0000-0000-0000-000000000000}"
        with pytest.raises(Exception, match="instantiate"):
            fmu.instantiate(callbacks=fmu.callbacks)
        assert "build the FMU again" in fmu.messages[-1]
        fmu.component = good
