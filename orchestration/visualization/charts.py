"""What is shown of a result over time: groups of courses with labels and units, for whatever draws them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from .manipulator import ZERO_CELSIUS, members, of_heat, of_rod

__all__ = ["COLOURS", "Chart", "Line", "charts"]

COLOURS = ("#2f6fdf", "#e8833a", "#2a9d6f", "#b04ec4", "#8a6d3b", "#d6455d")


@dataclass(frozen=True)
class Line:
    """values (time,), in the chart's unit. dashed: beside the point of the chart."""

    label: str
    values: np.ndarray
    colour: str
    dashed: bool = False


@dataclass(frozen=True)
class Chart:
    title: str
    unit: str
    lines: tuple[Line, ...]
    log: bool = False
    stepped: bool = False  # a value belongs to the macro step that ends there
    from_zero: bool = False


@dataclass(frozen=True)
class _Group:
    """variables: name -> labels of its elements; one label with {} serves any number of them."""

    title: str
    variables: dict[str, tuple[str, ...]]
    aside: tuple[str, ...] = ()  # those that are dashed
    milli: bool = False
    log: bool = False
    stepped: bool = False
    from_zero: bool = False


_XYZ = ("x", "y", "z")
_HEAT = (
    _Group("Voltages", {"V": ("TCA {}",)}),
    _Group(
        "Temperatures",
        {"T": ("TCA {}, mean",), "T_max": ("hottest point",), "T_surface": ("surface, mean",)},
        ("T_max", "T_surface"),
    ),
    _Group("Heat flows", {"P": ("into TCA {}",), "Q_loss": ("through the surface",)}, ("Q_loss",)),
    _Group("Heat stored since the start", {"E_stored": ("stored",)}),
)
_ROD = (
    _Group("Angles of the tip", {"tip.euler": ("α", "β", "γ")}),
    _Group("Position of the tip", {"tip.p": _XYZ}, milli=True),
    _Group("Velocity of the tip", {"tip.v": _XYZ}, milli=True),
    _Group("Displacements of the TCAs", {"delta": ("TCA {}",)}, milli=True),
    _Group("Tensions of the TCAs", {"N": ("TCA {}",)}),
    _Group(
        "Energies of the rod",
        {
            f"energy.{kind}": (label,)
            for kind, label in {
                "elastic": "elastic, body",
                "tca": "elastic, TCAs",
                "kinetic": "kinetic",
                "gravity": "gravity",
                "dissipated": "dissipated",
            }.items()
        },
        milli=True,
    ),
    _Group("Gravity", {"gravity": _XYZ}),
    _Group("Force on the tip", {"tip_force": _XYZ}, milli=True),
    _Group("Moment on the tip", {"tip_moment": _XYZ}, milli=True),
)
_COUPLING = (
    _Group("Sweeps per macro step", {"sweeps": ("sweeps",)}, stepped=True, from_zero=True),
    _Group("Loop gain (above 1 plain iteration diverges)", {"gain": ("spectral radius of one sweep",)}, from_zero=True),
    _Group("Length of the macro steps", {"step": ("step",)}, milli=True, stepped=True, from_zero=True),
    _Group(
        "Coupling residual and error, share of the nominals",
        {"error": ("estimated error",), "residual": ("last residual",)},
        ("residual",),
        log=True,
    ),
)


def charts(result: xr.Dataset) -> list[Chart]:
    """Those with something else than zeros in them: heat, rod, other members a chart per unit, coupling."""
    known = {of_heat(result): _HEAT, of_rod(result): _ROD}
    found: list[Chart] = []
    for member in members(result):
        found += _known(result, member, known[member]) if member in known else _unknown(result, member)
    return found + list(_known(result, "coupling", _COUPLING))


def _known(result: xr.Dataset, member: str, groups: tuple[_Group, ...]) -> Iterator[Chart]:
    for group in groups:
        lines: list[Line] = []
        unit = ""
        for name, labels in group.variables.items():
            array = result.get(f"{member}.{name}")
            if array is None or not np.nan_to_num(array).any():
                continue
            values, unit = _shown(array, group.milli)
            if group.stepped:
                values[0] = np.nan  # the start has no step before it
            if group.log:
                values[values <= 0.0] = np.nan
            each = labels if len(labels) > 1 else [labels[0].format(k + 1) for k in range(values.shape[1])]
            for label, course in zip(each, values.T, strict=True):
                lines.append(Line(label, course, COLOURS[len(lines) % len(COLOURS)], name in group.aside))
        if lines:
            yield Chart(group.title, unit, tuple(lines), group.log, group.stepped, group.from_zero)


def _unknown(result: xr.Dataset, member: str) -> Iterator[Chart]:
    by_unit: dict[str, list[tuple[str, np.ndarray]]] = {}
    for name, array in result.data_vars.items():
        if not str(name).startswith(f"{member}."):
            continue
        values, unit = _shown(array, milli=False)
        label = str(name).removeprefix(f"{member}.")
        labels = [label] if array.ndim == 1 else [f"{label}[{k + 1}]" for k in range(values.shape[1])]
        by_unit.setdefault(unit, []).extend(zip(labels, values.T, strict=True))
    for unit, courses in by_unit.items():
        lines = tuple(Line(label, c, COLOURS[k % len(COLOURS)]) for k, (label, c) in enumerate(courses))
        yield Chart(member, unit, lines)


def _shown(array: xr.DataArray, milli: bool) -> tuple[np.ndarray, str]:
    """(time, n), a copy, in a unit for people: degrees Celsius for kelvin, thousandths where asked for."""
    values, unit = array.to_numpy().reshape(array.sizes["time"], -1).astype(float), array.attrs.get("units", "1")
    if unit == "K":
        return values - ZERO_CELSIUS, "°C"
    return (1e3 * values, f"m{unit}") if milli else (values, unit)
