"""Quantities as people write them ("40 mm", "25 degC") to numbers in a variable's unit, by pint."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from .variables import BASE_UNITS

__all__ = ["convert"]

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*", re.DOTALL)
_POWER = re.compile(r"(?<=[A-Za-z])(-?\d)")  # FMI writes m2 for m^2
_PINT_NAMES = ("kilogram", "meter", "second", "ampere", "kelvin", "mole", "candela", "radian")  # of BASE_UNITS


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint  # half a second that scenes with bare numbers need not spend

    return pint.UnitRegistry()


def convert(
    text: str,
    dimension: Mapping[str, int] | None,
    unit: str,
    difference: bool = False,
    factor: float = 1.0,
    offset: float = 0.0,
) -> float:
    """Convert a text such as "3 V" to the number in `unit`.

    Parameters
    ----------
    text
        A number and a unit, or a number alone.
    dimension, factor, offset
        Definition of `unit` as in a BaseUnit of FMI: exponents of the SI base units, and the value in them, which is
        factor * number + offset. dimension None: the FMU does not define its unit; then the name alone counts.
    unit
        Name of the variable's unit.
    difference
        Whether the quantity is an interval, so that 5 degC is 5 K.

    Raises
    ------
    ValueError
        The unit is not known, has another dimension (radians count as one), or there is no number.
    """
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise ValueError("not a number with a unit")
    number, written = float(match[1]), match[2]
    if not written or written == unit:
        return number
    value, zero, exponents = _in_base_units(number, written)
    if dimension is None:
        one, offset, dimension = _in_base_units(1.0, unit)
        factor = one - offset
    if exponents != {name: power for name, power in dimension.items() if power}:
        raise ValueError(f"unit {written!r} does not fit")
    return (value - zero if difference else value - offset) / factor


def _in_base_units(number: float, name: str) -> tuple[float, float, dict[str, int]]:
    """Return a quantity and the zero of its unit in SI base units by pint, and their exponents.

    ValueError where pint knows no such unit.
    """
    registry = _registry()
    try:
        unit = _parsed(name)
        zero, value = (registry.Quantity(x, unit).to_base_units() for x in (0.0, number))
        exponents = {BASE_UNITS[_PINT_NAMES.index(base)]: power for base, power in value.unit_items() if power}
    except Exception as error:  # pint's parser fails in many ways on what is not a unit
        raise ValueError(f"unit {name!r} is not known") from error
    return float(value.magnitude), float(zero.magnitude), exponents


@lru_cache(maxsize=1024)
def _parsed(name: str) -> Any:
    return _registry().Unit(_POWER.sub(r"**\1", name).replace(".", "*"))
