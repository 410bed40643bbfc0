"""Conversion between the units of variables that FMUs and SSP archives define.

Two units are the same if exponents of the base units, factor and offset are (FMI 2.0.4, 2.2.2); rad is a base unit.
Names decide only where a unit has no definition.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ..fmi.archive import Variable

__all__ = ["Unit", "conversion", "unit_of"]


@dataclass(frozen=True)
class Unit:
    """A unit: value in SI base units = factor * value + offset."""

    name: str
    dimension: Mapping[str, int] | None = None  # exponents of SI base units and rad; None: only the name is known
    factor: float = 1.0
    offset: float = 0.0

    @property
    def exponents(self) -> Mapping[str, int] | None:
        """Exponents of the base units that are not 0; the unit "1" needs no definition."""
        if self.dimension is None:
            return {} if self.name == "1" else None
        return {base: power for base, power in self.dimension.items() if power}

    def __str__(self) -> str:
        """Name and base units in FMI's notation: 'N' (kg.m.s-2)."""
        powers = self.exponents or {}
        text = ".".join(f"{base}{'' if power == 1 else power}" for base, power in powers.items()) or "1"
        return f"{self.name!r} ({text})"


def unit_of(variable: Variable) -> Unit | None:
    """Return the unit of a variable, None where the FMU declares none."""
    if not variable.has_unit:
        return None
    return Unit(variable.unit, variable.dimension, variable.factor, variable.offset)


def conversion(source: Unit | None, target: Unit | None, difference: bool = False) -> tuple[float, float]:
    """Convert between units.

    Parameters
    ----------
    source, target
        None: no unit is given, so nothing is converted.
    difference
        Whether values are differences (FMI's relativeQuantity), to which offsets do not apply.

    Returns
    -------
    tuple of float
        factor and offset: target value = factor * source value + offset.

    Raises
    ------
    ValueError
        The units measure different quantities, or one of them has no definition.
    """
    if source is None or target is None:
        return 1.0, 0.0
    if source.exponents is None or target.exponents is None:
        if source.name == target.name:
            return 1.0, 0.0
        undefined = " and ".join(repr(unit.name) for unit in (source, target) if unit.exponents is None)
        raise ValueError(
            f"units differ: {source.name!r} and {target.name!r}; {undefined} has no definition by base units, which a "
            "conversion needs"
        )
    if source.exponents != target.exponents:
        raise ValueError(f"units differ: {source} and {target} do not measure the same quantity")
    if not (source.factor and target.factor and math.isfinite(source.factor) and math.isfinite(target.factor)):
        raise ValueError(f"units {source.name!r} and {target.name!r}: a factor is 0 or not finite")
    if (source.factor, source.offset) == (target.factor, target.offset):
        return 1.0, 0.0
    offset = 0.0 if difference else (source.offset - target.offset) / target.factor
    return source.factor / target.factor, offset
