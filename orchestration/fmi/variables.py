"""Variables of modelDescription.xml with the numbers that scenes and results need."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import SceneError

if TYPE_CHECKING:
    from lxml import etree

__all__ = ["TYPES", "Unit", "Value", "Variable", "read_variables"]

Value = float | int | bool | str
TYPES = ("Real", "Integer", "Boolean", "String", "Enumeration")
BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
INTEGER_RANGE = (-(2**31), 2**31 - 1)  # of fmi2Integer
MAX_REFERENCE = 2**32 - 1  # of fmi2ValueReference


@dataclass(frozen=True)
class Variable:
    """Declaration of one scalar variable; numbers are in the variable's own unit.

    A value in SI base units is factor * value + offset.
    """

    name: str
    reference: int
    type: str  # one of TYPES
    causality: str
    variability: str
    description: str
    unit: str  # "1" where the FMU declares none
    dimension: Mapping[str, int] | None = field(repr=False)  # exponents of BASE_UNITS; None: the FMU defines none
    nominal: float = 1.0
    least: float = -math.inf
    most: float = math.inf
    start: Value | None = None
    items: tuple[str, ...] = ()  # names of an enumeration's items
    item_values: tuple[int, ...] = ()  # their values; default 1, 2, ...
    has_unit: bool = True
    factor: float = 1.0
    offset: float = 0.0
    has_nominal: bool = True
    relative: bool = False  # relativeQuantity: a difference, to which the offset of its unit does not apply
    declared_type: str = ""

    def __post_init__(self) -> None:
        if self.items and not self.item_values:
            object.__setattr__(self, "item_values", tuple(range(1, len(self.items) + 1)))

    @property
    def discrete(self) -> bool:
        """Whether the value changes at events only, so that it is held between communication points."""
        return self.type != "Real" or self.variability != "continuous"

    def item_value(self, item: str) -> int:
        """Value of an enumeration's item; ValueError where there is no such item."""
        return self.item_values[self.items.index(item)]

    def item_name(self, value: float) -> str:
        """Item of an enumeration with this value; ValueError where there is none."""
        return self.items[self.item_values.index(int(value))]


class Unit(NamedTuple):
    """Definition of a unit: a value in SI base units is factor * value + offset."""

    exponents: dict[str, int]  # of BASE_UNITS, those that are not 0
    factor: float
    offset: float


def read_variables(root: etree._Element) -> dict[str, Variable]:
    """Read all variables of an FMI 2.0 model description.

    Parameters
    ----------
    root
        Root element of modelDescription.xml.

    Returns
    -------
    dict
        Name -> variable, in the order of the XML.

    Raises
    ------
    SceneError
        Names the element, its line and the attribute that cannot be read.
    """
    units = {}
    for unit in root.iterfind("UnitDefinitions/Unit"):
        with _naming("unit", unit):
            units[unit.get("name", "")] = _unit(unit.find("BaseUnit"))
    types = {t.get("name", ""): _type_element(t) for t in root.iterfind("TypeDefinitions/SimpleType")}
    variables: dict[str, Variable] = {}
    for element in root.iterfind("ModelVariables/ScalarVariable"):
        with _naming("variable", element):
            variable = _variable(element, types, units)
            if variable.name in variables:
                raise ValueError("the name is declared twice")
        variables[variable.name] = variable
    return variables


@contextlib.contextmanager
def _naming(kind: str, element: etree._Element) -> Iterator[None]:
    """Turn a ValueError into a SceneError that names the element."""
    try:
        yield
    except ValueError as error:
        name = element.get("name", "")
        raise SceneError(
            f"{kind} {name!r} (line {element.sourceline} of modelDescription.xml): {error}; correct it in the XML, or "
            "export the FMU again"
        ) from error


def _unit(base: etree._Element | None) -> Unit | None:
    """Read a BaseUnit; None where a unit has none."""
    if base is None:
        return None
    powers = {name: _parsed(name, base.get(name, "0"), int) for name in BASE_UNITS}
    factor, offset = (
        _parsed(key, base.get(key, default), float) for key, default in (("factor", "1"), ("offset", "0"))
    )
    if not (math.isfinite(factor) and math.isfinite(offset)) or factor == 0.0:
        raise ValueError(f"factor = {factor}, offset = {offset} define no unit")
    return Unit({name: power for name, power in powers.items() if power}, factor, offset)


def _type_element(parent: etree._Element) -> etree._Element | None:
    return next((child for child in parent if child.tag in TYPES), None)


def _variable(
    element: etree._Element, types: Mapping[str, etree._Element | None], units: Mapping[str, Unit | None]
) -> Variable:
    name, own = element.get("name", ""), _type_element(element)
    if not name:
        raise ValueError("there is no name")
    if own is None:
        raise ValueError(f"there is no type; allowed: {', '.join(TYPES)}")
    declared = types.get(own.get("declaredType", ""))

    def attribute(key: str) -> str | None:
        value = own.get(key)
        return value if value is not None or declared is None else declared.get(key)

    def number(key: str, default: float) -> float:
        text = attribute(key)
        return default if text is None else _parsed(key, text, float)

    kind = str(own.tag)
    unit = attribute("unit") or ""
    base = units.get(unit)
    least, most = INTEGER_RANGE if kind == "Integer" else (-math.inf, math.inf)
    start = own.get("start")
    items = tuple(_items(declared)) if kind == "Enumeration" and declared is not None else ()
    return Variable(
        name=name,
        reference=_reference(element.get("valueReference")),
        type=kind,
        causality=element.get("causality", "local"),
        variability=element.get("variability", "continuous" if kind == "Real" else "discrete"),
        description=element.get("description", ""),
        unit=unit or "1",
        dimension=None if base is None else base.exponents,
        nominal=abs(number("nominal", 1.0)) or 1.0,  # some exporters write 0, which FMI does not allow
        least=max(least, number("min", -math.inf)),
        most=min(most, number("max", math.inf)),
        start=None if start is None else _parsed("start", start, _READERS[kind]),
        items=tuple(name for name, _ in items),
        item_values=tuple(value for _, value in items),
        has_unit=bool(unit),
        factor=1.0 if base is None else base.factor,
        offset=0.0 if base is None else base.offset,
        has_nominal=attribute("nominal") is not None,
        relative=attribute("relativeQuantity") in ("true", "1"),
        declared_type=own.get("declaredType", ""),
    )


def _items(declared: etree._Element) -> Iterator[tuple[str, int]]:
    for item in declared.iterfind("Item"):
        yield item.get("name", ""), _parsed("value", item.get("value", ""), _integer)


def _parsed(key: str, text: str, reader: Callable[[str], Any]) -> Any:
    try:
        return reader(text.strip() if reader is not str else text)
    except (ValueError, OverflowError) as error:
        raise ValueError(f"{key} = {text!r} is not a value of its type") from error


def _reference(text: str | None) -> int:
    reference = _parsed("valueReference", text or "", int)
    if not 0 <= reference <= MAX_REFERENCE:
        raise ValueError(f"valueReference = {text!r} is out of range; allowed: 0 to {MAX_REFERENCE}")
    return int(reference)


def _integer(text: str) -> int:
    """Read a whole number, also as 1.0, which some exporters write."""
    value = int(text) if text.lstrip("+-").isdigit() else int(float(text))
    if value != float(text) or not INTEGER_RANGE[0] <= value <= INTEGER_RANGE[1]:
        raise ValueError(text)
    return value


def _boolean(text: str) -> bool:
    """Read a truth value, also as True, which some exporters write."""
    if text.lower() not in ("true", "false", "0", "1"):
        raise ValueError(text)
    return text.lower() in ("true", "1")


_READERS: dict[str, Callable[[str], Value]] = {
    "Real": float,
    "Integer": _integer,
    "Enumeration": _integer,
    "Boolean": _boolean,
    "String": str,
}
