"""An SSP 1.0 archive (System Structure and Parameterization) as a layer of a scene: FMUs, wiring, values, stop time,
and the macro step where OMSimulator's annotation gives one.

One flat system of co-simulation FMUs. Its inputs and parameters hand their values on; its outputs are no more than
names. What else the standard has is refused by the name of its element, but for drawings and annotations, which have
no effect."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from fmpy.ssp import ssd as fmpy_ssp
from lxml import etree

from ..errors import SceneError
from ..fmi.archive import Archive, Variable, similar
from ..fmi.variables import base_unit_exponents
from .validation import Layer

__all__ = ["read"]

_SSP = "http://ssp-standard.org/SSP1/SystemStructure"
_SPACES = {"ssc": f"{_SSP}Common", "ssd": f"{_SSP}Description", "ssv": f"{_SSP}ParameterValues"}
_STEP = ".//{*}FixedStepMaster[@stepSize]"
_SILENT = {"SystemGeometry", "ElementGeometry", "ConnectorGeometry", "ConnectionGeometry", "GraphicalElements"} | {
    "Annotations",
    "DefaultExperiment",
    "Enumerations",
    "Units",
}
# Element -> the children that are read.
_READ = {
    "SystemStructureDescription": {"System"},
    "System": {"Connectors", "ParameterBindings", "Elements", "Connections"},
    "Elements": {"Component"},
    "Component": {"Connectors", "ParameterBindings"},
    "Connectors": {"Connector"},
    "Connector": {"Real", "Integer", "Boolean", "String", "Enumeration"},
    "Connections": {"Connection"},
    "Connection": set(),
    "ParameterBindings": {"ParameterBinding"},
    "ParameterBinding": {"ParameterValues"},
    "ParameterValues": {"ParameterSet"},
    "ParameterSet": {"Parameters"},
    "Parameters": {"Parameter"},
    "Parameter": {"Real", "Integer", "Boolean", "String", "Enumeration"},
}


@dataclass(frozen=True)
class _Units:
    """name -> exponents of SI base units, factor, offset, as one document declares them."""

    known: Mapping[str, tuple[dict[str, int], float, float]]

    @classmethod
    def of(cls, root: etree._Element) -> _Units:
        known = {}
        for unit in root.iterfind(".//ssc:Unit", _SPACES):
            base = unit.find("ssc:BaseUnit", _SPACES)
            about = fmpy_ssp.Unit(name=unit.get("name"), **({} if base is None else dict(base.attrib)))
            known[about.name] = base_unit_exponents(about), about.factor, about.offset
        return cls(known)

    def convert(self, value: float, unit: str | None, variable: Variable) -> float:
        """Into the variable's unit. Raises ValueError."""
        if unit is None or unit == variable.unit or not variable.has_unit:
            return value
        if unit not in self.known:
            raise ValueError(f"unit {unit!r} is not declared; declare it, or give the value in {variable.unit!r}")
        exponents, factor, offset = self.known[unit]
        if exponents != dict(variable.dimension or {}):
            raise ValueError(f"unit {unit!r} does not fit; give a unit that converts to {variable.unit!r}")
        return (factor * value + offset - variable.offset) / variable.factor


def read(path: Path, chosen: str | None = None, archive: Callable[[Path], Archive] = Archive) -> Layer:
    """chosen: a parameter set of the archive, by the name of its file up to the first dot, in place of those bound.
    Raises SceneError, which names the element."""
    try:
        with zipfile.ZipFile(path) as opened:
            return _Reader(path, opened, chosen, archive).layer()
    except (OSError, zipfile.BadZipFile) as error:
        raise SceneError(f"{path}: not a readable SSP archive ({error})") from error


class _Reader:
    def __init__(
        self, path: Path, opened: zipfile.ZipFile, chosen: str | None, archive: Callable[[Path], Archive]
    ) -> None:
        self.path, self.opened, self.chosen = path, opened, chosen
        self.texts: list[str] = []
        root = self._document("SystemStructure.ssd", "SystemStructureDescription")
        self._supported(root)
        self.root, self.system = root, root.find("ssd:System", _SPACES)
        self.components = {c.get("name"): c for c in self.system.iterfind("ssd:Elements/ssd:Component", _SPACES)}
        self.archives = {name: archive(self._fmu(name, c)) for name, c in self.components.items()}
        self.connections = list(self.system.iterfind("ssd:Connections/ssd:Connection", _SPACES))

    def layer(self) -> Layer:
        wires = [c.attrib for c in self.connections if c.get("startElement") and c.get("endElement")]
        values = self._values({(c["endElement"], c["endConnector"]) for c in wires})
        raw: dict[str, Any] = {
            "title": self.system.get("description") or self.root.get("name"),
            "fmus": {name: str(archive.path) for name, archive in self.archives.items()},
            "connections": [
                f"{c['startElement']}.{c['startConnector']} -> {c['endElement']}.{c['endConnector']}" for c in wires
            ],
            **values,
        }
        experiment = self.root.find("ssd:DefaultExperiment", _SPACES)
        if experiment is not None:
            if float(experiment.get("startTime", 0.0)) != 0.0:
                self._refuse("DefaultExperiment", "startTime is not 0; shift it")
            if "stopTime" in experiment.attrib:
                raw["stop_time"] = float(experiment.get("stopTime"))
        step = self.root.find(_STEP)
        if step is not None:
            raw["coupling"] = {"macro_step": float(step.get("stepSize"))}
        return Layer(str(self.path), "\n".join(self.texts), raw)

    def _refuse(self, element: str, problem: str) -> None:
        raise SceneError(f"{self.path}: {element}: {problem}")

    def _document(self, entry: str, kind: str) -> etree._Element:
        """Valid to the standard's schema."""
        try:
            text = self.opened.read(entry)
            root = etree.fromstring(text, etree.XMLParser(resolve_entities=False, remove_comments=True))
            fmpy_ssp.validate_tree(root, f"SystemStructure{kind.removeprefix('SystemStructure')}.xsd")
        except KeyError:
            self._refuse(entry, "is not in the archive")
        except Exception as error:  # lxml's and FMPy's many ways to say that a document is not valid
            self._refuse(entry, f"is not valid SSP 1.0: {error}")
        self.texts.append(text.decode("utf-8", "replace"))
        return root

    def _supported(self, element: etree._Element) -> None:
        tag = etree.QName(element).localname
        for child in element:
            name = etree.QName(child).localname
            if name in _SILENT:
                continue
            if name not in _READ.get(tag, set()):
                called = child.get("name") or element.get("name") or element.get("endConnector") or ""
                self._refuse(f"{tag}/{name} {called}".strip(), "not supported; flatten the system or leave it out")
            self._supported(child)

    def _fmu(self, name: str, component: etree._Element) -> Path:
        if component.get("type", "application/x-fmu-sharedlibrary") != "application/x-fmu-sharedlibrary":
            self._refuse(f"Component {name}", f"type {component.get('type')!r} is not supported; give an FMU")
        if component.get("implementation", "any") == "ModelExchange":
            self._refuse(f"Component {name}", "implementation ModelExchange is not supported; export co-simulation")
        if "." in name:
            self._refuse(f"Component {name}", "a dot in the name is not supported; rename it")
        return self.path.resolve() / self._entry(component.get("source"), f"Component {name}")

    def _entry(self, source: str, element: str) -> str:
        entry = str(PurePosixPath(source))
        if entry not in self.opened.namelist():
            self._refuse(element, f"source {source!r} is not in the archive; put it there")
        return entry

    # -- values

    def _values(self, wired: set[tuple[str, str]]) -> dict[str, dict[str, Any]]:
        """component -> variable -> value. The outer level wins over a component's own, later bindings over earlier
        ones; a connection wins over the start value of the input that it feeds."""
        found: dict[str, dict[str, Any]] = {name: {} for name in self.components}
        for name, component in self.components.items():
            for parameter, units in self._parameters(component):
                self._put(found, [(name, parameter.get("name"))], parameter, units)
        for parameter, units in self._parameters(self.system):
            self._put(found, self._targets(parameter.get("name")), parameter, units)
        return {name: {v: x for v, x in values.items() if (name, v) not in wired} for name, values in found.items()}

    def _targets(self, name: str) -> list[tuple[str, str]]:
        """Where a value of the system goes: COMPONENT.VARIABLE, or through a connector of the system."""
        through = [c for c in self.connections if not c.get("startElement") and c.get("startConnector") == name]
        if through:
            return [(c.get("endElement"), c.get("endConnector")) for c in through]
        component, _, variable = name.partition(".")
        connectors = [c.get("name") for c in self.system.iterfind("ssd:Connectors/ssd:Connector", _SPACES)]
        if component not in self.components and name not in connectors:
            self._refuse(f"Parameter {name}", f"no such component; {similar(component, list(self.components))}")
        return [(component, variable)] if component in self.components else []

    def _put(
        self,
        found: dict[str, dict[str, Any]],
        targets: Sequence[tuple[str, str]],
        parameter: etree._Element,
        units: _Units,
    ) -> None:
        for component, name in targets:
            variables = self.archives[component].variables
            if name not in variables:
                self._refuse(f"Parameter {component}.{name}", f"no such variable; {similar(name, list(variables))}")
            try:
                found[component][name] = _value(parameter[0], variables[name], units)
            except ValueError as error:
                self._refuse(f"Parameter {component}.{name}", str(error))

    def _parameters(self, element: etree._Element) -> Iterator[tuple[etree._Element, _Units]]:
        """Those bound to an element; names with their prefix."""
        for binding in element.iterfind("ssd:ParameterBindings/ssd:ParameterBinding", _SPACES):
            for root in self._sets(binding, element.get("name")):
                units = _Units.of(root if len(_Units.of(root).known) else self.root)
                for parameter in root.iterfind(".//ssv:Parameter", _SPACES):
                    parameter.set("name", binding.get("prefix", "") + parameter.get("name"))
                    yield parameter, units

    def _sets(self, binding: etree._Element, owner: str) -> list[etree._Element]:
        source, where = binding.get("source"), f"ParameterBinding of {owner}"
        if binding.get("type", "application/x-ssp-parameter-set") != "application/x-ssp-parameter-set":
            self._refuse(where, f"type {binding.get('type')!r} is not supported; give an SSV file")
        if binding.get("sourceBase", "SSD") != "SSD":
            self._refuse(
                where, f"sourceBase {binding.get('sourceBase')!r} is not supported; put the file beside the SSD"
            )
        if source is None:
            return binding.findall("ssd:ParameterValues/ssv:ParameterSet", _SPACES)
        if self.chosen is not None:
            source = self._chosen(source, self.chosen)
        root = self._document(self._entry(source, where), "ParameterValues")
        self._supported(root)
        return [root]

    def _chosen(self, source: str, chosen: str) -> str:
        """The file of the chosen set beside the one that is bound: SET.ssv, or SET.COMPONENT.ssv."""
        bound = PurePosixPath(source)
        other = bound.with_name(".".join([chosen, *bound.name.split(".")[1:]]))
        entries = [PurePosixPath(entry) for entry in self.opened.namelist()]
        if other not in entries:
            known = {e.name.split(".")[0] for e in entries if e.suffix == ".ssv"}
            self._refuse(f"parameters = {chosen!r}", similar(chosen, sorted(known)))
        return str(other)


def _value(element: etree._Element, variable: Variable, units: _Units) -> float | int | bool | str:
    """In the variable's unit. Raises ValueError."""
    kind, text = etree.QName(element).localname, element.get("value")
    if kind == "Real":
        return units.convert(float(text), element.get("unit"), variable)
    if kind == "Integer":
        return int(text)
    if kind == "Boolean":
        return text in ("true", "1")
    return text if text is not None else element.get("name", "")
