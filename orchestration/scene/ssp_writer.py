"""A scene as an SSP 1.0 archive (System Structure and Parameterization), for tools that import whole systems:

    SystemStructure.ssd       FMUs, connectors with units, connections
    resources/*.fmu           the FMUs
    resources/SET.NAME.ssv    every parameter set that comes with the package, together with what the scene sets, for
                              the FMU of that name

The system is closed: Ecos and libcosim read no connectors of a system, and parameters at components only; FMPy wants
all inputs connected that have a connector. So the scene's signals are in the sets, as constant inputs of the FMUs.

All Real parameters are in every set, so that applying one set after another leaves nothing of the first; of the others
those that a set or the scene gives. Enumerations are written as Integers, the form in which FMI 2.0 sets them: FMPy and
OMSimulator pass them on as such; Ecos and libcosim have no enumerations and leave their start values with a warning
(which the set `measured` changes). The set of the scene is bound."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable
from pathlib import Path

from lxml import etree

from ..cosim.signals import Constant
from ..errors import SceneError
from ..fmi.archive import Variable
from . import Member, Scene, parameter_sets, read
from .manipulator import SSP_OUTPUTS

__all__ = ["SYSTEM", "write"]

SYSTEM = "manipulator"
Values = list[tuple[Variable, float | int | bool | str | None]]
_NAMESPACES = {
    name: f"http://ssp-standard.org/SSP1/SystemStructure{whole}"
    for name, whole in {"ssc": "Common", "ssd": "Description", "ssv": "ParameterValues"}.items()
}
# OMSimulator imports a system only if it says which of its masters is meant.
_OMS = "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"


def write(path: Path, name: str = "step", overrides: Iterable[str] = ("rod.closure=inside",)) -> None:
    """Writes a scene's archive, with the parameter set that it names bound. `inside` is the closure that needs no
    iterating master. Raises SceneError, also where a signal is not constant."""
    overrides = tuple(overrides)
    scene = read(name, overrides)
    sets = {set_name: read(name, (*overrides, f"parameters='{set_name}'")) for set_name in parameter_sets()}
    bound = next(set_name for set_name, other in sets.items() if _values(other) == _values(scene))
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("SystemStructure.ssd", _text(_structure(scene, bound)))
        for set_name, other in sets.items():
            for owner, values in _values(other).items():
                archive.writestr(_set_file(set_name, owner), _text(_parameter_set(values, set_name)))
        for member in scene.members:
            archive.write(member.archive.path, f"resources/{member.archive.path.name}")


def _structure(scene: Scene, bound: str) -> etree._Element:
    root = _root("ssd:SystemStructureDescription", SYSTEM)
    system = _add(root, "ssd:System", name=SYSTEM, description=scene.title)
    elements = _add(system, "ssd:Elements")
    used = {member.name: _used(member, scene) for member in scene.members}
    for member in scene.members:
        component = _add(
            elements,
            "ssd:Component",
            name=member.name,
            type="application/x-fmu-sharedlibrary",
            source=f"resources/{member.archive.path.name}",
            implementation="CoSimulation",
        )
        _connectors(component, used[member.name])
        bindings = _add(component, "ssd:ParameterBindings")
        _add(bindings, "ssd:ParameterBinding", source=_set_file(bound, member.name))
    connections = _add(system, "ssd:Connections")
    for c in scene.connections:
        start = {"startElement": c.source[0], "startConnector": c.source[1]}
        _add(connections, "ssd:Connection", **start, endElement=c.target[0], endConnector=c.target[1])
    _step_size(system, scene)
    _units(root, "ssd:Units", [variable for variables in used.values() for variable in variables])
    _add(root, "ssd:DefaultExperiment", startTime="0", stopTime=repr(scene.stop_time))
    return root


def _used(member: Member, scene: Scene) -> list[Variable]:
    """What gets a connector."""
    wired = [end for c in scene.connections for end in (c.target, c.source)]
    vectors = member.archive.vectors.items()
    shown = [name for base, names in vectors if f"{member.name}.{base}" in SSP_OUTPUTS for name in names]
    names = dict.fromkeys([*(name for owner, name in wired if owner == member.name), *shown])
    return [member.archive.variables[name] for name in names]


def _set_file(set_name: str, member: str) -> str:
    return f"resources/{set_name}.{member}.ssv"


def _parameter_set(values: Values, name: str) -> etree._Element:
    root = _root("ssv:ParameterSet", name)
    parameters = _add(root, "ssv:Parameters")
    for variable, value in values:
        parameter = _add(parameters, "ssv:Parameter", name=variable.name)
        if variable.type == "Real":
            _add(parameter, "ssv:Real", value=repr(value), unit=variable.unit)
        elif variable.type == "Boolean":
            _add(parameter, "ssv:Boolean", value="true" if value else "false")
        else:
            _add(parameter, "ssv:Integer", value=str(value))
    _units(root, "ssv:Units", [variable for variable, _ in values if variable.type == "Real"])
    return root


def _values(scene: Scene) -> dict[str, Values]:
    """What is set, by FMU: parameters, and inputs that have a constant signal."""
    found: dict[str, Values] = {}
    for member in scene.members:
        values = found.setdefault(member.name, [])
        for variable in member.archive.variables.values():
            real = variable.type == "Real"
            if variable.causality == "parameter" and (real or variable.name in member.parameters):
                values.append((variable, member.value(variable.name)))
        for name, signal in member.signals.items():
            if not isinstance(signal, Constant):
                raise SceneError(
                    f"{scene.name}: {member.name}.{name} varies in time; an SSP archive holds constants only"
                )
            values.append((member.archive.variables[name], signal.value))
    return found


def _connectors(parent: etree._Element, variables: Iterable[Variable]) -> None:
    connectors = _add(parent, "ssd:Connectors")
    for variable in variables:
        connector = _add(connectors, "ssd:Connector", name=variable.name, kind=variable.causality)
        _add(connector, "ssc:Real", unit=variable.unit)


def _units(root: etree._Element, tag: str, variables: Iterable[Variable]) -> None:
    units = _add(root, tag)
    for name, dimension in sorted({variable.unit: variable.dimension or {} for variable in variables}.items()):
        unit = _add(units, "ssc:Unit", name=name)
        _add(unit, "ssc:BaseUnit", **{base: str(power) for base, power in dimension.items()})


def _step_size(system: etree._Element, scene: Scene) -> None:
    annotation = _add(_add(system, "ssd:Annotations"), "ssc:Annotation", type="org.openmodelica")
    about = etree.SubElement(annotation, f"{{{_OMS}}}Annotations", nsmap={"oms": _OMS})
    about = etree.SubElement(about, f"{{{_OMS}}}SimulationInformation")
    step, tolerance = repr(scene.coupling.macro_step), repr(scene.coupling.tolerance)
    settings = {"stepSize": step, "absoluteTolerance": tolerance, "relativeTolerance": tolerance}
    etree.SubElement(about, f"{{{_OMS}}}FixedStepMaster", description="oms-ma", **settings)


def _tag(short: str) -> str:
    prefix, name = short.split(":")
    return f"{{{_NAMESPACES[prefix]}}}{name}"


def _root(tag: str, name: str) -> etree._Element:
    return etree.Element(_tag(tag), nsmap=_NAMESPACES, version="1.0", name=name, generationTool="tca-cosim")


def _add(parent: etree._Element, tag: str, **attributes: str) -> etree._Element:
    return etree.SubElement(parent, _tag(tag), attributes)


def _text(root: etree._Element) -> bytes:
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
