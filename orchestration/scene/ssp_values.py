"""Values that the parameter sets of an SSP archive give to the variables of its FMUs.

Of several values of a variable the one bound at the outermost system holds; at one element, the one bound last (SSP
1.0, 5.3.1.1). Names without a variable are ignored, as the standard has it, and named in a warning.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import PurePosixPath

from lxml import etree

from ..errors import SceneWarning
from ..fmi.archive import Variable, similar
from .ssp_archive import SPACES, local_name, unit_definitions
from .ssp_structure import Connector, Structure, attribute_number
from .unit_conversion import Unit

__all__ = ["Value", "values"]

_SET, _MAPPING = "application/x-ssp-parameter-set", "application/x-ssp-parameter-mapping"
_REAL = ("Real", "Float64", "Float32")
Scalar = float | int | bool | str


@dataclass(frozen=True)
class Value:
    """A parameter of a set.

    kind: as in Real; value; unit, if it states one; the transformation that its mapping asks for once the unit is
    converted.
    """

    name: str
    kind: str
    value: Scalar
    unit: Unit | None
    factor: float = 1.0
    offset: float = 0.0
    origin: tuple[str, str] = ("", "")  # file and name there


@dataclass(frozen=True)
class _Mapped:
    """An entry of a parameter mapping."""

    target: str
    factor: float = 1.0
    offset: float = 0.0
    table: Mapping[str, str] | None = None
    suppressed: bool = False  # whether units are not converted


def values(structure: Structure, chosen: str | None) -> dict[str, dict[str, Scalar]]:
    """Collect the values by component and variable, in the variables' units.

    chosen: name of a parameter set of the archive to take instead of those bound. Raises SceneError; warns with
    SceneWarning of names that no variable has.
    """
    reader = _Reader(structure, chosen)
    for path, component in sorted(structure.components.items(), key=lambda item: -len(item[0])):
        for value in reader.bound(component.element):
            reader.put(Connector(path, value.name), value)
    for path, system in sorted(structure.systems.items(), key=lambda item: -len(item[0])):
        for value in reader.bound(system):
            reader.put_by_name(path, value)
    reader.warn()
    return reader.values


class _Reader:
    def __init__(self, structure: Structure, chosen: str | None) -> None:
        self.structure, self.archive, self.chosen = structure, structure.archive, chosen
        self.values: dict[str, dict[str, Scalar]] = {c.name: {} for c in structure.components.values()}
        self.ignored: dict[str, tuple[tuple[str, str], str]] = {}  # name -> origin of the value, remedy
        self.used: set[tuple[str, str]] = set()  # origins of values that set something

    # -- what a value sets

    def put_by_name(self, path: tuple[str, ...], value: Value) -> None:
        """Set what a hierarchical name, seen from a system, stands for: a connector of it, or ELEMENT.NAME."""
        connector = Connector(path, value.name)
        if connector in self.structure.kinds:
            self.put_through(connector, value)
            return
        elements = [p for p in (*self.structure.components, *self.structure.systems) if p and p[:-1] == path]
        fitting = [p for p in elements if value.name.startswith(f"{p[-1]}.")]
        if not fitting:
            name = value.name.partition(".")[0]
            self.ignored[str(connector)] = value.origin, similar(name, [p[-1] for p in elements])
            return
        inner = max(fitting, key=lambda p: len(p[-1]))
        rest = replace(value, name=value.name[len(inner[-1]) + 1 :])
        if inner in self.structure.components:
            self.put(Connector(inner, rest.name), rest)
        else:
            self.put_by_name(inner, rest)

    def put(self, connector: Connector, value: Value) -> None:
        """Set a variable of a component."""
        component = self.structure.components[connector.path]
        variable = component.archive.variables.get(connector.name)
        if variable is None:
            self.ignored[str(connector)] = value.origin, similar(connector.name, component.archive.variables)
            return
        try:
            factor, offset = self.structure.value_in(connector, variable, value.unit, value.factor, value.offset)
        except ValueError as error:
            self.archive.refuse(f"Parameter {connector}", f"{error}; give a unit that converts to {variable.unit!r}")
        self._set(component.name, variable, value, factor, offset)

    def put_through(self, connector: Connector, value: Value) -> None:
        """Set the variables that a connector of a system feeds."""
        for reached in self.structure.reached(connector, value.unit, value.factor, value.offset):
            self._set(reached.component, reached.variable, value, reached.factor, reached.offset)

    def _set(self, component: str, variable: Variable, value: Value, factor: float, offset: float) -> None:
        self.used.add(value.origin)
        scaled = value.value
        if (factor, offset) != (1.0, 0.0) and not isinstance(scaled, str):
            scaled = factor * scaled + offset
        whole = variable.type in ("Integer", "Enumeration") and isinstance(scaled, float)
        self.values[component][variable.name] = int(scaled) if whole and float(scaled).is_integer() else scaled

    def warn(self) -> None:
        """Warn once of all values that set nothing: of a file that serves several components, those that none has."""
        ignored = {name: remedy for name, (origin, remedy) in self.ignored.items() if origin not in self.used}
        if ignored:
            names = [f"{name} ({remedy})" for name, remedy in list(ignored.items())[:3]]
            more = f" and {len(ignored) - 3} more" if len(ignored) > 3 else ""
            text = f"{self.archive.path}: no variable has the name of parameter {', '.join(names)}{more}; ignored"
            warnings.warn(text, SceneWarning, stacklevel=2)

    # -- reading sets and mappings

    def bound(self, element: etree._Element) -> Iterator[Value]:
        """The values bound to an element, in the order in which they are to be set."""
        for binding in element.iterfind("ssd:ParameterBindings/ssd:ParameterBinding", SPACES):
            where = f"ParameterBinding of {element.get('name')}"
            self._supported(binding, _SET, where, "an SSV file")
            mapping = self._mapping(binding, where)
            prefix = binding.get("prefix", "")
            for root in self._sets(binding, where):
                units = {**self.structure.definitions, **unit_definitions(self.archive, root)}
                for parameter in root.iterfind("ssv:Parameters/ssv:Parameter", SPACES):
                    value = self._value(parameter, prefix, units, binding.get("source", where))
                    if mapping is not None and value.name not in mapping:
                        self.ignored[value.name] = value.origin, "not in the parameter mapping"
                    for entry in [_Mapped(value.name)] if mapping is None else mapping.get(value.name, ()):
                        yield self._transformed(value, entry)

    def _supported(self, element: etree._Element, kind: str, where: str, remedy: str) -> None:
        if element.get("type", kind) != kind:
            self.archive.refuse(where, f"type {element.get('type')!r} is not supported; give {remedy}")
        if element.get("sourceBase", "SSD") != "SSD":
            self.archive.refuse(
                where, f"sourceBase {element.get('sourceBase')!r} is not supported; put the file beside the SSD"
            )

    def _sets(self, binding: etree._Element, where: str) -> list[etree._Element]:
        source = binding.get("source")
        if source is None:
            return list(binding.iterfind("ssd:ParameterValues/ssv:ParameterSet", SPACES))
        entry = self._chosen(source, self.chosen) if self.chosen is not None else self.archive.resolve(source, where)
        return [self.archive.document(entry, "ParameterSet")]

    def _chosen(self, source: str, chosen: str) -> str:
        """The file of the chosen set beside the one that is bound: SET.ssv, or SET.COMPONENT.ssv."""
        bound = PurePosixPath(source)
        other = bound.with_name(".".join([chosen, *bound.name.split(".")[1:]]))
        entries = [PurePosixPath(entry) for entry in self.archive.entries]
        if other not in entries:
            known = {e.name.split(".")[0] for e in entries if e.suffix == ".ssv"}
            self.archive.refuse(f"parameters = {chosen!r}", similar(chosen, known))
        return str(other)

    def _value(self, parameter: etree._Element, prefix: str, units: Mapping[str, Unit], source: str) -> Value:
        name = prefix + parameter.get("name")
        typed = next((child for child in parameter if local_name(child) != "Annotations"), None)
        if typed is None:
            self.archive.refuse(f"Parameter {name}", "has no value; add for example <ssv:Real value='1.0'/>")
        kind, text = local_name(typed), typed.get("value")
        if text is None:
            self.archive.refuse(f"Parameter {name}", f"{kind} without attribute 'value'; add it")
        unit = None
        if stated := typed.get("unit"):
            unit = units.get(stated) or Unit(stated)
        try:
            return Value(name, kind, _scalar(kind, text), unit, origin=(source, name))
        except ValueError:
            self.archive.refuse(f"Parameter {name}", f"{text!r} is not a value of type {kind}")

    def _mapping(self, binding: etree._Element, where: str) -> dict[str, list[_Mapped]] | None:
        element = binding.find("ssd:ParameterMapping", SPACES)
        if element is None:
            return None
        self._supported(element, _MAPPING, f"ParameterMapping of {where}", "an SSM file")
        root = element.find("ssm:ParameterMapping", SPACES)
        if source := element.get("source"):
            root = self.archive.document(
                self.archive.resolve(source, f"ParameterMapping of {where}"), "ParameterMapping"
            )
        entries: dict[str, list[_Mapped]] = {}
        for item in () if root is None else root.iterfind("ssm:MappingEntry", SPACES):
            entries.setdefault(item.get("source"), []).append(self._mapped(item))
        return entries

    def _mapped(self, entry: etree._Element) -> _Mapped:
        target, suppressed = entry.get("target"), entry.get("suppressUnitConversion", "false") in ("true", "1")
        for child in entry:
            if local_name(child) == "LinearTransformation":
                factor, offset = (
                    attribute_number(self.archive, child, key, default, f"MappingEntry {target}")
                    for key, default in (("factor", 1.0), ("offset", 0.0))
                )
                return _Mapped(target, factor, offset, suppressed=suppressed)
            if local_name(child).endswith("MappingTransformation"):
                boolean = local_name(child).startswith("Boolean")
                table = {_key(item.get("source"), boolean): item.get("target") for item in child}
                return _Mapped(target, table=table, suppressed=suppressed)
        return _Mapped(target, suppressed=suppressed)

    def _transformed(self, value: Value, entry: _Mapped) -> Value:
        value = replace(value, name=entry.target, unit=None if entry.suppressed else value.unit)
        if entry.table is not None:
            key = _key(str(value.value), value.kind == "Boolean")
            if key not in entry.table:
                self.archive.refuse(
                    f"Parameter {value.name}",
                    f"the mapping has no entry for {value.value!r}; {similar(key, entry.table)}",
                )
            return replace(value, value=_scalar(value.kind, entry.table[key]))
        if (entry.factor, entry.offset) == (1.0, 0.0):
            return value
        if value.kind in ("String", "Boolean", "Enumeration"):
            self.archive.refuse(
                f"Parameter {value.name}", f"a linear transformation of type {value.kind}; use a number"
            )
        return replace(value, factor=entry.factor, offset=entry.offset)


def _key(text: str, boolean: bool) -> str:
    """Key of a mapping table; booleans have two spellings each."""
    return {"1": "true", "0": "false"}.get(text.lower(), text.lower()) if boolean else text


def _scalar(kind: str, text: str) -> Scalar:
    """Raises ValueError."""
    if kind in _REAL:
        return float(text)
    if kind == "Boolean":
        if text.strip() not in ("true", "false", "1", "0"):
            raise ValueError
        return text.strip() in ("true", "1")
    return text if kind in ("String", "Enumeration") else int(text)
