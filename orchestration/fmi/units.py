"""Quantities as people write them ("40 mm", "25 degC", 3.0) to numbers in a variable's own unit, by pint."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

__all__ = ["convert"]

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")
_POWER = re.compile(r"(?<=[A-Za-z])(-?\d)")  # FMI writes m2 for m^2


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint  # half a second that scenes with bare numbers need not spend

    return pint.UnitRegistry()


def convert(
    text: str,
    dimension: Mapping[str, int],
    unit: str,
    difference: bool = False,
    factor: float = 1.0,
    offset: float = 0.0,
) -> float:
    """The number in `unit` for a text such as "3 V". dimension, factor, offset: of `unit` in SI base units as FMI
    declares them; difference: an interval, so that 5 degC is 5 K. A unit unknown to pint, another dimension or no
    number raise ValueError."""
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise ValueError("not a number with a unit")
    number, written = float(match[1]), match[2]
    if not written or written == unit:
        return number
    registry = _registry()
    try:
        parsed = registry.Unit(_POWER.sub(r"**\1", written).replace(".", "*"))
        base = registry.Quantity(number, parsed).to_base_units()
        if difference:
            base = base - registry.Quantity(0.0, parsed).to_base_units()
    except Exception as error:  # pint's parser fails in many ways on what is not a unit
        raise ValueError(f"unit {written!r} is not known") from error
    if base.dimensionality != _target(dimension).dimensionality:
        raise ValueError(f"unit {written!r} does not fit")
    value = float(base.to(_target(dimension)).magnitude)
    return (value if difference else value - offset) / factor


def _target(dimension: Mapping[str, int]) -> Any:
    target = _registry().Unit("")
    for name, power in dimension.items():
        target = target * _registry().Unit(name) ** power
    return target
