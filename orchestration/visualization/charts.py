"""Charts of a result over time, as data: lines with labels and units, for matplotlib and for the page.

Quantities that do not change are no lines: they are listed as constants, with their value.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from ..errors import CosimError
from .manipulator import ZERO_CELSIUS, heat_members, members, rod_members

__all__ = ["Chart", "Line", "charts", "charts_of", "in_unit"]

_MILLI = 1e3
_CONSTANT = 1e-6  # a line whose range is below this fraction of its quantity's largest value does not change


@dataclass(frozen=True)
class Line:
    """One curve of a chart."""

    label: str
    values: np.ndarray  # (time,) in the chart's unit
    number: int  # of its colour
    dashed: bool = False  # for quantities that accompany the others
    name: str = ""  # scalar name in the result, rod.tip.p[1]; empty where the chart has no quantity of the result


@dataclass(frozen=True)
class Constant:
    """Quantity of a chart that does not change."""

    label: str
    value: float  # in the chart's unit


@dataclass(frozen=True)
class Chart:
    """Quantities of one unit; without lines where all of them are constant."""

    title: str
    unit: str
    lines: tuple[Line, ...]
    constants: tuple[Constant, ...] = ()
    log: bool = False
    stepped: bool = False  # a value belongs to the macro step that ends at its time
    from_zero: bool = False

    @property
    def heading(self) -> str:
        """Title and unit."""
        return self.title if self.unit == "1" else f"{self.title} [{self.unit}]"

    @property
    def constants_text(self) -> str:
        """Constants with their values; equal ones together."""
        by_value: dict[str, list[str]] = {}
        for constant in self.constants:
            by_value.setdefault(f"{constant.value + 0.0:.4g}", []).append(constant.label)
        unit = "" if self.unit == "1" else f" {self.unit}"
        return "; ".join(f"{', '.join(labels)} = {value}{unit}" for value, labels in by_value.items())


@dataclass(frozen=True)
class _Quantity:
    """Variable of a chart; one label with {} serves any number of elements."""

    name: str
    labels: tuple[str, ...]
    dashed: bool = False


@dataclass(frozen=True)
class _Group:
    """Chart of a member that the package knows."""

    title: str
    quantities: tuple[_Quantity, ...]
    milli: bool = False
    log: bool = False
    stepped: bool = False
    from_zero: bool = False


def _vector(title: str, name: str, milli: bool = False) -> _Group:
    return _Group(title, (_Quantity(name, ("x", "y", "z")),), milli)


def _per_tca(title: str, name: str, milli: bool = False) -> _Group:
    return _Group(title, (_Quantity(name, ("TCA {}",)),), milli)


_HEAT = (
    _per_tca("Voltages", "V"),
    _Group(
        "Temperatures",
        (
            _Quantity("T", ("TCA {}, mean",)),
            _Quantity("T_max", ("hottest point",), dashed=True),
            _Quantity("T_surface", ("surface, mean",), dashed=True),
        ),
    ),
    _Group(
        "Heat flows",
        (_Quantity("P", ("into TCA {}",)), _Quantity("Q_loss", ("through the surface",), dashed=True)),
    ),
    _Group("Heat stored since the start", (_Quantity("E_stored", ("stored",)),)),
)
_ENERGIES = {
    "elastic": "elastic, body",
    "tca": "elastic, TCAs",
    "kinetic": "kinetic",
    "gravity": "gravity",
    "dissipated": "dissipated",
}
_ROD = (
    _Group("Angles of the tip", (_Quantity("tip.euler", ("α", "β", "γ")),)),
    _vector("Position of the tip", "tip.p", milli=True),
    _vector("Velocity of the tip", "tip.v", milli=True),
    _per_tca("Displacements of the TCAs", "delta", milli=True),
    _per_tca("Tensions of the TCAs", "N"),
    _per_tca("Creep of the TCAs", "creep", milli=True),
    _Group(
        "Energies of the rod",
        tuple(_Quantity(f"energy.{kind}", (label,)) for kind, label in _ENERGIES.items()),
        milli=True,
    ),
    _vector("Gravity", "gravity"),
    _vector("Force on the tip", "tip_force", milli=True),
    _vector("Moment on the tip", "tip_moment", milli=True),
)
_COUPLING = (
    _Group("Sweeps per macro step", (_Quantity("sweeps", ("sweeps",)),), stepped=True, from_zero=True),
    _Group(
        "Loop gain (above 1 plain iteration diverges)",
        (_Quantity("gain", ("spectral radius of one sweep",)),),
        from_zero=True,
    ),
    _Group("Length of the macro steps", (_Quantity("step", ("step",)),), milli=True, stepped=True, from_zero=True),
    _Group(
        "Coupling residual and error, share of the nominals",
        (_Quantity("error", ("estimated error",)), _Quantity("residual", ("last residual",), dashed=True)),
        log=True,
    ),
)


def charts(result: xr.Dataset, wanted: Collection[str] = ()) -> list[Chart]:
    """Charts of all quantities that are not zero: heat, rod, other members with a chart per unit, coupling.

    wanted: scalar names, such as rod.tip.p[1], that are lines even where they do not change; those that no chart has
    get one of their own.
    """
    known = _known_members(result)
    drawn: list[Chart] = []
    for member in members(result):
        groups = known.get(member)
        drawn += _by_unit(result, member, wanted) if groups is None else _known(result, member, groups, wanted)
    drawn += _known(result, "coupling", _COUPLING)
    there = {line.name for chart in drawn for line in chart.lines}
    return drawn + charts_of(result, [name for name in wanted if name not in there])


def charts_of(result: xr.Dataset, quantities: Iterable[str]) -> list[Chart]:
    """Charts of chosen quantities, one each.

    Parameters
    ----------
    quantities : iterable of str
        Names of variables of the result, such as ``rod.tip.p``, or of one element, such as ``rod.tip.p[1]``.

    Raises
    ------
    CosimError
        The result has no quantity of that name, or it is not one over time with at most one index.
    """
    known = {**_known_members(result), "coupling": _COUPLING}
    return [_chosen(result, name, known) for name in quantities]


def _known_members(result: xr.Dataset) -> dict[str | None, tuple[_Group, ...]]:
    """Charts of each member that the package knows; of several of a kind each names its own in its titles."""
    known: dict[str | None, tuple[_Group, ...]] = {}
    for names, groups in ((rod_members(result), _ROD), (heat_members(result), _HEAT)):
        for name in names:
            titled = tuple(replace(group, title=f"{group.title}, {name}") for group in groups)
            known[name] = titled if len(names) > 1 else groups
    return known


def _chosen(result: xr.Dataset, name: str, known: dict[str | None, tuple[_Group, ...]]) -> Chart:
    base, _, index = name.partition("[")
    array = result.get(base)
    drawable = [str(n) for n, a in result.data_vars.items() if a.dims[:1] == ("time",) and a.ndim <= 2]
    if array is None or base not in drawable:
        near = difflib.get_close_matches(base, drawable, 5) or drawable[:5]
        raise CosimError(f"quantity {name!r}: not in the result; nearest names: {', '.join(near)}")
    count = array.sizes[array.dims[1]] if array.ndim == 2 else 1
    element = index.rstrip("]")
    if index and not (element.isdigit() and array.ndim == 2 and 1 <= int(element) <= count):
        elements = f" or {base}[1] to {base}[{count}]" if array.ndim == 2 else ""
        raise CosimError(f"quantity {name!r}: allowed: {base}{elements}")
    member = next((m for m in known if m and base.startswith(f"{m}.")), None)
    for group in known.get(member, ()):
        for quantity in group.quantities:
            if f"{member}.{quantity.name}" == base:
                one = _Group(group.title, (quantity,), group.milli, group.log, group.stepped, group.from_zero)
                return _only(_group_chart(result, str(member), one), int(element) if index else None)
    values, unit = _values(array, milli=False)
    curves = list(zip(_names(base, array), values.T, strict=True))
    return _only(_chart(base, unit, curves), int(element) if index else None)


def _names(base: str, array: xr.DataArray) -> list[str]:
    """Scalar names of the elements of a quantity over time."""
    return [base] if array.ndim == 1 else [f"{base}[{k + 1}]" for k in range(array[0].size)]


def _only(chart: Chart, element: int | None) -> Chart:
    """Chart of all quantities as lines, also constant ones, or of one element."""
    if element is None:
        return chart
    lines = [line for line in chart.lines if line.number == element - 1]
    return Chart(chart.title, chart.unit, tuple(lines), (), chart.log, chart.stepped, chart.from_zero)


def _known(result: xr.Dataset, member: str, groups: Sequence[_Group], wanted: Collection[str] = ()) -> Iterator[Chart]:
    bases = {name.partition("[")[0] for name in wanted}
    for group in groups:
        nonzero = tuple(
            quantity
            for quantity in group.quantities
            if (name := f"{member}.{quantity.name}") in result and (name in bases or np.nan_to_num(result[name]).any())
        )
        if nonzero:
            chosen = _Group(group.title, nonzero, group.milli, group.log, group.stepped, group.from_zero)
            yield _without_constants(_group_chart(result, member, chosen), wanted)


def _group_chart(result: xr.Dataset, member: str, group: _Group) -> Chart:
    """Chart of a group whose quantities the result has; every element is a line."""
    lines: list[Line] = []
    unit = ""
    for quantity in group.quantities:
        base = f"{member}.{quantity.name}"
        values, unit = _values(result[base], group.milli)
        if group.stepped:
            values[0] = np.nan  # no step ends at the start
        if group.log:
            values[values <= 0.0] = np.nan
        count = values.shape[1]
        labels = (
            quantity.labels if len(quantity.labels) > 1 else [quantity.labels[0].format(k + 1) for k in range(count)]
        )
        for label, curve, name in zip(labels, values.T, _names(base, result[base]), strict=True):
            lines.append(Line(label, curve, len(lines), quantity.dashed, name))
    return Chart(group.title, unit, tuple(lines), (), group.log, group.stepped, group.from_zero)


def _by_unit(result: xr.Dataset, member: str, wanted: Collection[str]) -> Iterator[Chart]:
    """Charts of a member that the package does not know: one for each unit."""
    by_unit: dict[str, list[tuple[str, np.ndarray]]] = {}
    for name, array in result.data_vars.items():
        if not str(name).startswith(f"{member}."):
            continue
        values, unit = _values(array, milli=False)
        by_unit.setdefault(unit, []).extend(zip(_names(str(name), array), values.T, strict=True))
    for unit, curves in by_unit.items():
        yield _without_constants(_chart(member, unit, curves), wanted)


def _chart(title: str, unit: str, curves: Sequence[tuple[str, np.ndarray]]) -> Chart:
    """Chart of curves by their names in the result; labels leave out the member that the title names."""
    lines = (Line(name.removeprefix(f"{title}."), curve, k, name=name) for k, (name, curve) in enumerate(curves))
    return Chart(title, unit, tuple(lines))


def _without_constants(chart: Chart, wanted: Collection[str] = ()) -> Chart:
    """Move the lines that do not change, and are not wanted, to the constants."""
    largest = max((np.nanmax(np.abs(line.values), initial=0.0) for line in chart.lines), default=0.0)
    lines, constants = [], []
    for line in chart.lines:
        known = line.values[np.isfinite(line.values)]
        scale = np.abs(known).max(initial=0.0) if chart.log else largest
        if known.size and line.name not in wanted and np.ptp(known) <= _CONSTANT * scale:
            constants.append(Constant(line.label, float(known[-1]) if abs(known[-1]) > _CONSTANT * scale else 0.0))
        elif known.size:
            lines.append(line)
    return Chart(chart.title, chart.unit, tuple(lines), tuple(constants), chart.log, chart.stepped, chart.from_zero)


def in_unit(values: np.ndarray, unit: str, shown: str) -> np.ndarray:
    """Values of a result's unit in that of a chart: degrees Celsius for kelvin, thousandths."""
    if unit == "K" != shown:
        return values - ZERO_CELSIUS
    return values if shown == unit else _MILLI * values


def _values(array: xr.DataArray, milli: bool) -> tuple[np.ndarray, str]:
    """Copy (time, n) in a unit for people: degrees Celsius for kelvin, thousandths where asked for."""
    values, unit = array.to_numpy().reshape(array.sizes["time"], -1).astype(float), array.attrs.get("units", "1")
    if unit == "K":
        return values - ZERO_CELSIUS, "°C"
    return (_MILLI * values, f"m{unit}") if milli else (values, unit)
