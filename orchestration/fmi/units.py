"""Quantities as people write them ("40 mm", "25 degC") to numbers in a variable's unit, by pint."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from ..packages import version
from .cache import keep_bytes, kept_bytes
from .variables import BASE_UNITS

__all__ = ["convert"]

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*", re.DOTALL)
_POWER = re.compile(r"(?<=[A-Za-z])(-?\d)")  # FMI writes m2 for m^2
CACHE_FORMAT = 1  # of the units kept between processes; another number for other content
_PROBES = (1.0, -1.0, 0.1, 1.0 / 3.0, 7.03, 40.0, 12345.6789, 1e-7, 3.3e9)  # values at which kept units are compared
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
    known = _kept_units().get(name)
    if known is None:
        quantity = _by_pint(number, name)
        _checked(name)
        return quantity
    factor, zero, exponents = known
    return _linear(number, factor, zero), zero, exponents


def _linear(number: float, factor: float, zero: float) -> float:
    return number * factor + zero if zero else number * factor


@lru_cache(maxsize=1024)
def _checked(name: str) -> None:
    """Keep the definition of a unit where a factor and an offset give what pint gives, to the last bit."""
    one, zero, exponents = _by_pint(1.0, name)
    factor = one - zero if zero == 0.0 else 1.0
    if all(_by_pint(number, name)[0] == _linear(number, factor, zero) for number in _PROBES):
        _kept_units()[name] = (factor, zero, exponents)
        keep_bytes(_cache_name(), json.dumps(_kept_units()).encode())


@lru_cache(maxsize=1)
def _kept_units() -> dict[str, tuple[float, float, dict[str, int]]]:
    """Return name -> factor, offset, exponents of the units seen in earlier processes: pint takes long to load."""
    content = kept_bytes(_cache_name())
    if content is None:
        return {}
    return {
        str(name): (float(factor), float(zero), {str(base): int(power) for base, power in exponents.items()})
        for name, (factor, zero, exponents) in json.loads(content).items()
    }


@lru_cache(maxsize=1)
def _cache_name() -> str:
    return f"units/pint-{version('pint')}-{CACHE_FORMAT}.json"


def _by_pint(number: float, name: str) -> tuple[float, float, dict[str, int]]:
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
