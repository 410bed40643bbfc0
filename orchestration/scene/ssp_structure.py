"""The system of an SSP archive without its hierarchy: components, and what every output and value reaches.

Connectors are nodes of a graph whose edges are the connections, directed by the kinds of the connectors and not by
their attributes start and end (SSP 1.0, 5.3.4.1). Systems and signal dictionaries only pass values on. Along a path
units are converted where both ends of a connection have one; the linear transformation of a connection comes after
that (SSP 1.0, 5.1.2).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from lxml import etree

from ..fmi.archive import Archive, Variable, similar
from .ssp_archive import SPACES, SSPArchive, unit_definitions
from .unit_conversion import Unit, conversion, unit_of

__all__ = ["Component", "Connector", "Reached", "Structure", "attribute_number"]

_FMU, _DEFINITION = "application/x-fmu-sharedlibrary", "application/x-ssp-definition"
_PACKAGE = "application/x-ssp-package"
_DICTIONARY = "application/x-ssp-signal-dictionary"
_SOURCES, _TARGETS = ("output", "calculatedParameter"), ("input", "parameter")


class Connector(NamedTuple):
    """A connector of a component, a system or a signal dictionary.

    path: names of the elements from the outermost system inwards; () is that system.
    """

    path: tuple[str, ...]
    name: str

    def __str__(self) -> str:
        return ".".join((*self.path, self.name))


class Edge(NamedTuple):
    """A connection. The target's value is factor * value + offset, after the conversion of units unless suppressed."""

    target: Connector
    suppressed: bool
    factor: float
    offset: float


class Reached(NamedTuple):
    """A variable of an FMU that a value reaches as factor * value + offset."""

    component: str
    variable: Variable
    factor: float
    offset: float


@dataclass(frozen=True)
class Component:
    """An FMU of the system. name: its path joined by dots, the name of the member of the scene."""

    name: str
    path: tuple[str, ...]
    element: etree._Element
    archive: Archive


@dataclass
class Structure:
    """The flat system.

    systems: by path, from the outermost inwards; units: of the connectors that state one; definitions: units that the
    SSD defines, by name. Raises SceneError, which names the element.
    """

    archive: SSPArchive
    open_fmu: Callable[[Path], Archive]
    components: dict[tuple[str, ...], Component] = field(default_factory=dict)
    systems: dict[tuple[str, ...], etree._Element] = field(default_factory=dict)
    kinds: dict[Connector, str] = field(default_factory=dict)
    units: dict[Connector, Unit] = field(default_factory=dict)
    definitions: dict[str, Unit] = field(default_factory=dict)
    edges: dict[Connector, list[Edge]] = field(default_factory=dict)
    _dictionaries: dict[tuple[tuple[str, ...], str], dict[str, Unit | None]] = field(default_factory=dict)
    _references: dict[tuple[str, ...], tuple[tuple[str, ...], str]] = field(default_factory=dict)
    _fed: set[Connector] = field(default_factory=set)
    _documents: tuple[str, ...] = ()  # entries of the SSDs being read, against circles

    def add_system(self, system: etree._Element, root: etree._Element, path: tuple[str, ...] = ()) -> None:
        """Read a system and all that it contains. root: of the document, whose units hold."""
        definitions = unit_definitions(self.archive, root)
        self.definitions = {**definitions, **self.definitions}
        self.systems[path] = system
        self._add_connectors(system, path, definitions)
        self._add_dictionaries(system, path, definitions)
        elements = system.find("ssd:Elements", SPACES)
        for element in () if elements is None else elements:
            inner = (*path, element.get("name"))
            if inner in self.components or inner in self.systems or inner in self._references:
                self.archive.refuse(f"Element {'.'.join(inner)}", "the name is taken by another element; rename one")
            tag = etree.QName(element).localname
            if tag == "System":
                self.add_system(element, root, inner)
            elif tag == "SignalDictionaryReference":
                self._references[inner] = self._dictionary(element, path)
            elif tag == "Component":
                self._add_component(element, root, inner, definitions)
        for connection in system.iterfind("ssd:Connections/ssd:Connection", SPACES):
            self._add_connection(connection, path)

    def reached(
        self, start: Connector, unit: Unit | None = None, factor: float = 1.0, offset: float = 0.0
    ) -> Iterator[Reached]:
        """Follow the connections from a connector to the variables of FMUs, whose units values are converted to.

        unit: of the value at the connector; None: that of the connector, if it states one. factor, offset: a
        transformation of the value once it is in the connector's unit.
        """
        source, stated = self._variable(start), self.units.get(start)
        first = unit_of(source) if source else unit
        begin = ((stated, Edge(start, False, factor, offset)),)
        for hops, end, variable in self._paths(start, begin, frozenset()):
            difference = variable.relative and (source is None or source.relative)
            try:
                whole = self._transformation(first, hops, unit_of(variable), difference)
            except ValueError as error:
                self.archive.refuse(f"Connection {start} to {end}", f"{error}; connect connectors of one quantity")
            yield Reached(self.components[end.path].name, variable, *whole)

    def value_in(
        self, connector: Connector, variable: Variable, unit: Unit | None, factor: float = 1.0, offset: float = 0.0
    ) -> tuple[float, float]:
        """Factor and offset that convert a value given at a component's connector to the variable's unit.

        factor, offset: a transformation of the value once it is in the connector's unit. Raises ValueError.
        """
        stated = self.units.get(connector) or unit_of(variable)
        hops = ((stated, Edge(connector, False, factor, offset)),)
        return self._transformation(unit, hops, unit_of(variable), variable.relative)

    # -- reading

    def _add_connectors(self, element: etree._Element, path: tuple[str, ...], definitions: dict[str, Unit]) -> None:
        for item in element.iterfind("ssd:Connectors/ssd:Connector", SPACES):
            connector = Connector(path, item.get("name"))
            self.kinds[connector] = item.get("kind")
            unit = self._unit(item, str(connector), definitions)
            if unit is not None:
                self.units[connector] = unit

    def _unit(self, item: etree._Element, name: str, definitions: dict[str, Unit]) -> Unit | None:
        """Unit of a connector or dictionary entry. One without a definition has its name only."""
        for child in item:
            if (text := child.get("unit")) and etree.QName(child).localname != "ConnectorGeometry":
                return definitions.get(text, Unit(text))
        return None

    def _add_component(
        self, element: etree._Element, root: etree._Element, path: tuple[str, ...], definitions: dict[str, Unit]
    ) -> None:
        name, kind, source = ".".join(path), element.get("type", _FMU), element.get("source")
        if kind == _DEFINITION:
            self._add_definition(element, root, path, source)
            return
        if kind == _PACKAGE or source.lower().endswith((".ssp", ".ssd")):
            self.archive.refuse(
                f"Component {name}",
                f"source {source!r} is no FMU; put an SSP package's files into a folder of this archive, and give its "
                f'SystemStructure.ssd as source with type="{_DEFINITION}"',
            )
        if kind != _FMU:
            self.archive.refuse(f"Component {name}", f"type {kind!r} is not supported; give an FMU")
        if any(component.name == name for component in self.components.values()):
            self.archive.refuse(f"Component {name}", "another component has the same name with its path; rename one")
        file = self.archive.file(self.archive.resolve(source, f"Component {name}"))
        fmu = self.open_fmu(file)
        if element.get("implementation", "any") == "ModelExchange" and fmu.description.co_simulation is not None:
            self.archive.refuse(
                f"Component {name}",
                "implementation ModelExchange is not used where an FMU offers co-simulation; remove it",
            )
        self.components[path] = Component(name, path, element, fmu)
        self._add_connectors(element, path, definitions)

    def _add_definition(
        self, element: etree._Element, root: etree._Element, path: tuple[str, ...], source: str
    ) -> None:
        """Read a component that is a system: of another SSD of the archive, or one of this SSD by its id."""
        where = f"Component {'.'.join(path)}"
        entry, _, fragment = source.partition("#")
        if entry in self._documents:
            self.archive.refuse(where, f"source {source!r} contains itself")
        if entry:
            entry = self.archive.resolve(entry, where)
            root = self.archive.document(entry, "SystemStructureDescription")
            system = root.find("ssd:System", SPACES)
        else:
            systems = [s for s in root.iter(f"{{{SPACES['ssd']}}}System") if s.get("id") == fragment]
            system = systems[0] if systems else None
            entry = source
        if system is None:
            self.archive.refuse(where, f"source {source!r} names no system; give one of an SSD")
        before, self._documents = self._documents, (*self._documents, entry)
        self.add_system(system, root, path)
        self._documents = before
        for bindings in element.iterfind("ssd:ParameterBindings", SPACES):  # they come after the system's own
            system.append(bindings)

    def _add_dictionaries(self, system: etree._Element, path: tuple[str, ...], definitions: dict[str, Unit]) -> None:
        for item in system.iterfind("ssd:SignalDictionaries/ssd:SignalDictionary", SPACES):
            name = item.get("name") or ""
            if item.get("type", _DICTIONARY) != _DICTIONARY:
                self.archive.refuse(
                    f"SignalDictionary {name}", f"type {item.get('type')!r} is not supported; give an SSB file"
                )
            inline = item.find("ssb:SignalDictionary", SPACES)
            source = item.get("source")
            if source is not None:
                entry = self.archive.resolve(source, f"SignalDictionary {name}")
                inline = self.archive.document(entry, "SignalDictionary")
                definitions = {**definitions, **unit_definitions(self.archive, inline)}
            entries = [] if inline is None else inline.iterfind("ssb:DictionaryEntry", SPACES)
            self._dictionaries[path, name] = {
                entry.get("name"): self._unit(entry, entry.get("name"), definitions) for entry in entries
            }

    def _dictionary(self, reference: etree._Element, path: tuple[str, ...]) -> tuple[tuple[str, ...], str]:
        """The dictionary of that name in this system, or in the nearest around it."""
        name = reference.get("dictionary")
        for depth in range(len(path), -1, -1):
            if (path[:depth], name) in self._dictionaries:
                return path[:depth], name
        known = [dictionary for _, dictionary in self._dictionaries]
        self.archive.refuse(
            f"SignalDictionaryReference {reference.get('name')}", f"no dictionary {name!r}; {similar(name, known)}"
        )

    def _add_connection(self, item: etree._Element, path: tuple[str, ...]) -> None:
        ends = [
            self._end(path, item.get(f"{end}Element"), item.get(f"{end}Connector") or "") for end in ("start", "end")
        ]
        (start, gives), (end, takes) = ends
        if gives is takes and gives is not None:
            what = "outputs" if gives else "inputs"
            self.archive.refuse(f"Connection {start} to {end}", f"both are {what}; connect an output to an input")
        if gives is False or takes is True:
            start, end = end, start
        if end in self._fed:
            self.archive.refuse(f"Connection {start} to {end}", f"{end} is fed twice; remove one of the connections")
        self._fed.add(end)
        factor, offset = 1.0, 0.0
        for child in item.iterfind("ssc:LinearTransformation", SPACES):
            factor, offset = (
                attribute_number(self.archive, child, key, default, f"Connection {start} to {end}")
                for key, default in (("factor", 1.0), ("offset", 0.0))
            )
        suppressed = item.get("suppressUnitConversion", "false") in ("true", "1")
        self.edges.setdefault(start, []).append(Edge(end, suppressed, factor, offset))

    def _end(self, path: tuple[str, ...], element: str | None, name: str) -> tuple[Connector, bool | None]:
        """One end of a connection, and whether it gives values (True), takes them (False) or both (None)."""
        if not element:
            connector = Connector(path, name)
            self._known(connector)
            return connector, _role(self.kinds[connector], inside=True)
        inner = (*path, element)
        if inner in self._references:
            scope, dictionary = self._references[inner]
            entries = self._dictionaries[scope, dictionary]
            if name not in entries:
                self.archive.refuse(f"Connector {'.'.join(inner)}.{name}", f"no such entry; {similar(name, entries)}")
            connector = Connector((*scope, f"dictionary {dictionary}"), name)
            if (unit := entries[name]) is not None:
                self.units[connector] = unit
            return connector, None
        connector = Connector(inner, name)
        if inner in self.components:
            variable = self._variable(connector)
            known = self.components[inner].archive.variables
            if variable is None:
                self.archive.refuse(f"Connector {connector}", f"no such variable; {similar(name, known)}")
            if variable.causality not in (*_SOURCES, *_TARGETS):
                self.archive.refuse(
                    f"Connector {connector}", f"the variable is {variable.causality}; connect outputs and inputs"
                )
            return connector, variable.causality in _SOURCES
        if inner in self.systems:
            self._known(connector)
            return connector, _role(self.kinds[connector], inside=False)
        names = [p[-1] for p in (*self.components, *self.systems, *self._references) if p and p[:-1] == path]
        self.archive.refuse(f"Connection to {'.'.join(inner)}.{name}", f"no such element; {similar(element, names)}")

    def _known(self, connector: Connector) -> None:
        if connector not in self.kinds:
            names = [other.name for other in self.kinds if other.path == connector.path]
            where = f"system {'.'.join(connector.path)}".strip()
            self.archive.refuse(
                f"Connector {connector}", f"the {where} has no such connector; {similar(connector.name, names)}"
            )

    # -- following connections

    def _transformation(
        self, unit: Unit | None, hops: tuple[tuple[Unit | None, Edge], ...], last: Unit | None, difference: bool
    ) -> tuple[float, float]:
        """Factor and offset along a path that begins in `unit` and ends in a variable of the unit `last`.

        Raises ValueError.
        """
        factor, offset = 1.0, 0.0
        for stated, edge in hops:
            if edge.suppressed:
                unit = stated
            elif stated is not None:
                gain, shift = conversion(self._defined(unit), self._defined(stated), difference)
                factor, offset, unit = gain * factor, gain * offset + shift, stated
            factor, offset = edge.factor * factor, edge.factor * offset + edge.offset
        gain, shift = conversion(self._defined(unit), last, difference)
        return gain * factor, gain * offset + shift

    def _defined(self, unit: Unit | None) -> Unit | None:
        """The unit; where the archive does not define it, as all FMUs that have a unit of that name do."""
        if unit is None or unit.exponents is not None:
            return unit
        variables = (v for c in self.components.values() for v in c.archive.variables.values())
        units = {
            (u.name, str(u), u.factor, u.offset): u for v in variables if (u := unit_of(v)) and u.name == unit.name
        }
        return next(iter(units.values())) if len(units) == 1 else unit

    def _variable(self, connector: Connector) -> Variable | None:
        component = self.components.get(connector.path)
        return component.archive.variables.get(connector.name) if component else None

    def _paths(
        self, connector: Connector, hops: tuple[tuple[Unit | None, Edge], ...], passed: frozenset[Connector]
    ) -> Iterator[tuple[tuple[tuple[Unit | None, Edge], ...], Connector, Variable]]:
        """All ways from a connector to variables of FMUs."""
        for edge in self.edges.get(connector, ()):
            if edge.target in passed:
                self.archive.refuse(f"Connection to {edge.target}", "connectors of systems feed each other in a circle")
            onward = (*hops, (self.units.get(edge.target), edge))
            variable = self._variable(edge.target)
            if variable is not None:
                yield onward, edge.target, variable
            else:
                yield from self._paths(edge.target, onward, passed | {connector})


def attribute_number(archive: SSPArchive, element: etree._Element, key: str, default: float, where: str) -> float:
    """Read an attribute that is a number; SceneError where it is not one."""
    try:
        return float(element.get(key, default))
    except ValueError:
        archive.refuse(where, f"{key} = {element.get(key)!r} is not a number")


def _role(kind: str, inside: bool) -> bool | None:
    """Whether a system's connector gives values: an input does to what is inside, an output to what is outside."""
    if kind in _SOURCES:
        return not inside
    return inside if kind in _TARGETS else None
