"""A scene as an SSP 1.0 archive (System Structure and Parameterization), for tools that import whole systems.

    SystemStructure.ssd       FMUs, connectors with units, connections
    resources/*.fmu           the FMUs
    resources/SET.NAME.ssv    every parameter set that comes with the package, together with what the scene sets, for
                              the FMU of that name

The system is closed: Ecos and libcosim read no connectors of a system, and parameters at components only; FMPy wants
all inputs connected that have a connector. So the scene's signals are in the sets, as constant inputs of the FMUs.

All Real parameters are in every set, so that applying one set after another leaves nothing of the first; of the others
those that a set or the scene gives. Enumerations are written as Integers, the form in which FMI 2.0 sets them: FMPy and
OMSimulator pass them on as such; Ecos and libcosim have no enumerations and leave their start values with a warning
(which the set `measured` changes). The set of the scene is bound.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from urllib.parse import quote

from lxml import etree

from ..cosim.signals import Constant
from ..errors import SceneError
from ..files import atomic_write
from ..fmi.archive import Variable
from ..fmi.unpacking import open_archive
from . import Member, Scene, parameter_sets, read
from .manipulator import SSP_OUTPUTS
from .ssp_sums import SUM_FMU, SumComponent, sum_archive, sum_components

__all__ = ["SYSTEM", "write", "write_scene"]

SYSTEM = "manipulator"
_FMU = {"type": "application/x-fmu-sharedlibrary", "implementation": "CoSimulation"}
Values = list[tuple[Variable, float | int | bool | str | None]]
_NAMESPACES = {
    name: f"http://ssp-standard.org/SSP1/SystemStructure{whole}"
    for name, whole in {"ssc": "Common", "ssd": "Description", "ssv": "ParameterValues"}.items()
}
# OMSimulator imports a system only if it says which of its masters is meant.
_OMS = "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"


def write(path: Path, name: str = "step", overrides: Iterable[str] = ("rod.closure=inside",)) -> None:
    """Write a scene as an archive, with the parameter set that it names bound.

    The default closure, inside, needs no master that iterates. Raises SceneError, also where a signal is not
    constant.
    """
    overrides = tuple(overrides)
    scene = read(name, overrides)
    sets = {set_name: read(name, (*overrides, f"parameters='{set_name}'")) for set_name in parameter_sets()}
    bound = next(set_name for set_name, other in sets.items() if _values(other) == _values(scene))
    _write(path, scene, sets, bound)


def write_scene(path: Path, scene: Scene) -> None:
    """Write a scene that is read already as an archive, with its values as the one parameter set, `scene`.

    Raises SceneError where a signal is not constant.
    """
    _write(path, scene, {"scene": scene}, "scene")


def _write(path: Path, scene: Scene, sets: Mapping[str, Scene], bound: str) -> None:
    with atomic_write(path) as draft, zipfile.ZipFile(draft, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("SystemStructure.ssd", _text(_structure(scene, bound)))
        for set_name, other in sets.items():
            for owner, values in _values(other).items():
                archive.writestr(_set_file(set_name, owner), _text(_parameter_set(values, set_name)))
            for one in sum_components(other):
                values = [(sum_archive().variables[name], value) for name, value in one.values.items()]
                archive.writestr(_set_file(set_name, one.name), _text(_parameter_set(values, set_name)))
        for member in {_source(scene, member): member for member in scene.members}.values():
            with open_archive(member.archive.path) as file:
                archive.writestr(_source(scene, member), file.read())
        if any(c.terms > 1 for c in scene.connections):
            archive.write(sum_archive().path, f"resources/{SUM_FMU}")


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
            **_FMU,
            source=quote(_source(scene, member)),
        )
        _connectors(component, used[member.name])
        bindings = _add(component, "ssd:ParameterBindings")
        _add(bindings, "ssd:ParameterBinding", source=_set_file(bound, member.name))
    sums = list(sum_components(scene))
    for one in sums:
        _add_sum(elements, one, bound)
    if scene.connections:
        _add_connections(system, scene, sums)
    _simulation_information(system, scene)
    _units(root, "ssd:Units", [variable for variables in used.values() for variable in variables])
    experiment = _add(root, "ssd:DefaultExperiment", startTime=repr(scene.start_time), stopTime=repr(scene.stop_time))
    # Older OMSimulators warn of an experiment without these.
    output = {"resultFile": f"{scene.name}.mat", "loggingInterval": "0.0", "bufferSize": "10"}
    etree.SubElement(_oms_annotations(experiment), f"{{{_OMS}}}SimulationInformation", output)
    return root


def _add_connections(system: etree._Element, scene: Scene, sums: Iterable[SumComponent]) -> None:
    """Add the connections of a scene, those of its sums included."""
    connections = _add(system, "ssd:Connections")
    for one in sums:
        _connect_sum(connections, one)
    for c in scene.connections:
        if c.terms > 1:
            continue
        start = {"startElement": c.source[0], "startConnector": c.source[1]}
        end = {"endElement": c.target[0], "endConnector": c.target[1]}
        if not c.transforms:
            _add(connections, "ssd:Connection", **start, **end)
            continue
        # The factor of the scene contains the conversion of units.
        connection = _add(connections, "ssd:Connection", **start, **end, suppressUnitConversion="true")
        _add(connection, "ssc:LinearTransformation", factor=repr(c.factor), offset=repr(c.offset))


def _add_sum(elements: etree._Element, one: SumComponent, bound: str) -> None:
    """Add the component of a sum. Its connectors have no unit: the gains contain the conversion."""
    component = _add(elements, "ssd:Component", name=one.name, **_FMU, source=f"resources/{SUM_FMU}")
    variables = sum_archive().variables
    _connectors(component, [variables[name] for name in (*(f"u[{k + 1}]" for k in range(len(one.terms))), "y")])
    bindings = _add(component, "ssd:ParameterBindings")
    _add(bindings, "ssd:ParameterBinding", source=_set_file(bound, one.name))


def _connect_sum(connections: etree._Element, one: SumComponent) -> None:
    """Connect the sources of a sum to it, and it to the input that it feeds."""
    ends = [((source, name), (one.name, f"u[{k}]")) for k, ((source, name), _) in enumerate(one.terms, 1)]
    if one.target is not None:
        ends.append(((one.name, "y"), one.target))
    for (source, output), (target, name) in ends:
        ends_of = {"startElement": source, "startConnector": output, "endElement": target, "endConnector": name}
        _add(connections, "ssd:Connection", **ends_of, suppressUnitConversion="true")


def _source(scene: Scene, member: Member) -> str:
    """Entry of a member's FMU; members of one FMU share it."""
    name = member.archive.path.name
    others = {m.archive.path for m in scene.members if m.archive.path.name == name}
    return f"resources/{name}" if len(others) == 1 and name != SUM_FMU else f"resources/{member.name}.fmu"


def _used(member: Member, scene: Scene) -> list[Variable]:
    """Variables that get a connector."""
    ends = [end for c in scene.connections for end in (c.target, c.source)]
    vectors = member.archive.vectors.items()
    shown = [name for base, names in vectors if f"{member.name}.{base}" in SSP_OUTPUTS for name in names]
    names = dict.fromkeys([*(name for owner, name in ends if owner == member.name), *shown])
    return [member.archive.variables[name] for name in names]


def _set_file(set_name: str, member: str) -> str:
    return f"resources/{set_name}.{member}.ssv"


def _parameter_set(values: Values, name: str) -> etree._Element:
    root = _root("ssv:ParameterSet", name)
    parameters = _add(root, "ssv:Parameters")
    for variable, value in values:
        parameter = _add(parameters, "ssv:Parameter", name=variable.name)
        if variable.type == "Real":
            _add(parameter, "ssv:Real", value=repr(value), **_unit(variable))
        elif variable.type == "Boolean":
            _add(parameter, "ssv:Boolean", value="true" if value else "false")
        elif variable.type == "String":
            _add(parameter, "ssv:String", value=str(value))
        else:
            _add(parameter, "ssv:Integer", value=str(int(value or 0)))
    _units(root, "ssv:Units", [variable for variable, _ in values if variable.type == "Real"])
    return root


def _values(scene: Scene) -> dict[str, Values]:
    """Values set, by FMU: parameters, and inputs that have a constant signal."""
    by_member: dict[str, Values] = {}
    for member in scene.members:
        values = by_member.setdefault(member.name, [])
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
    return by_member


def _connectors(parent: etree._Element, variables: Sequence[Variable]) -> None:
    if not variables:  # the schema wants one at least
        return
    connectors = _add(parent, "ssd:Connectors")
    for variable in variables:
        connector = _add(connectors, "ssd:Connector", name=variable.name, kind=variable.causality)
        _add(connector, f"ssc:{_kind(variable)}", **_unit(variable))


def _kind(variable: Variable) -> str:
    """Type of a connector; enumerations are Integers, the form in which FMI 2.0 sets them."""
    return "Integer" if variable.type == "Enumeration" else variable.type


def _unit(variable: Variable) -> dict[str, str]:
    return {"unit": variable.unit} if variable.type == "Real" and variable.has_unit else {}


def _units(root: etree._Element, tag: str, variables: Iterable[Variable]) -> None:
    definitions = {variable.unit: variable for variable in variables if _unit(variable)}
    if not definitions:
        return
    units = _add(root, tag)
    for name, variable in sorted(definitions.items()):
        unit = _add(units, "ssc:Unit", name=name)
        attributes = {base: str(power) for base, power in (variable.dimension or {}).items()}
        if (variable.factor, variable.offset) != (1.0, 0.0):
            attributes |= {"factor": repr(variable.factor), "offset": repr(variable.offset)}
        _add(unit, "ssc:BaseUnit", **attributes)


def _simulation_information(system: etree._Element, scene: Scene) -> None:
    """Step and tolerance for OMSimulator: attributes for the current release, a child for older ones.

    OMSimulator hands the tolerance to the FMUs, in which a tolerance of a parameter set wins: the smallest of theirs
    contradicts none by being looser.
    """
    step, tolerance = repr(scene.coupling.macro_step), repr(_tolerance(scene))
    information = etree.SubElement(
        _oms_annotations(system),
        f"{{{_OMS}}}SimulationInformation",
        {"name": "oms_ma_default", "method": "oms_ma", "fixedStepSize": step, "relativeTolerance": tolerance},
    )
    older = {"stepSize": step, "absoluteTolerance": tolerance, "relativeTolerance": tolerance}
    etree.SubElement(information, f"{{{_OMS}}}FixedStepMaster", {"description": "oms-ma", **older})


def _tolerance(scene: Scene) -> float:
    own = [float(value) for m in scene.members if isinstance(value := m.value("tolerance"), float)]
    return min(own, default=scene.coupling.tolerance)


def _oms_annotations(parent: etree._Element) -> etree._Element:
    """The element for OMSimulator's annotations of a part of the system."""
    annotation = _add(_add(parent, "ssd:Annotations"), "ssc:Annotation", type="org.openmodelica")
    return etree.SubElement(annotation, f"{{{_OMS}}}Annotations", nsmap={"oms": _OMS})


def _tag(short: str) -> str:
    prefix, name = short.split(":")
    return f"{{{_NAMESPACES[prefix]}}}{name}"


def _root(tag: str, name: str) -> etree._Element:
    return etree.Element(_tag(tag), nsmap=_NAMESPACES, version="1.0", name=name, generationTool="tca-cosim")


def _add(parent: etree._Element, tag: str, **attributes: str) -> etree._Element:
    return etree.SubElement(parent, _tag(tag), attributes)


def _text(root: etree._Element) -> bytes:
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
