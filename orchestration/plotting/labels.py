"""Labels of vectors and units that people use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["DisplayUnit", "display_unit", "element_labels"]

_ZERO_CELSIUS = 273.15  # [K]
_XYZ = (".p", ".v", "gravity", "force", "moment", "curvature")  # endings of the names of vectors in space


@dataclass(frozen=True)
class DisplayUnit:
    """Unit of a figure: shown = factor * value + offset."""

    name: str
    factor: float = 1.0
    offset: float = 0.0

    def convert(self, values: np.ndarray) -> np.ndarray:
        """Convert values of the result's unit."""
        return self.factor * values + self.offset


def display_unit(unit: str, difference: bool = False) -> DisplayUnit:
    """Unit in which a figure shows quantities of a unit: mm for m, degrees Celsius for kelvin but of differences."""
    if unit == "K" and not difference:
        return DisplayUnit("°C", offset=-_ZERO_CELSIUS)
    if unit in ("m", "m/s"):
        return DisplayUnit(f"m{unit}", 1e3)
    return DisplayUnit(unit)


def element_labels(name: str, count: int) -> list[str]:
    """Labels of the elements of a vector: x, y, z in space, angles, else numbers; the name itself of a scalar."""
    if count == 1:
        return [name]
    if count == 3 and name.endswith(_XYZ):
        return ["x", "y", "z"]
    if count == 3 and name.endswith("euler"):
        return ["α", "β", "γ"]
    return [f"{name.rpartition('.')[2]} {k + 1}" for k in range(count)]
