"""Checks of raw TOML values against the variables that an FMU declares.

Every refusal names file, line, key, value, what is allowed and the remedy.
"""

from __future__ import annotations

import itertools
import math
import re
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

from ..cosim.signals import Constant, Impulse, Ramps, Signal, Sine, Steps, pulses
from ..errors import SceneWarning
from ..fmi import units
from ..fmi.archive import Variable, similar
from .columns import column_signal
from .layer import Layer

__all__ = ["SHAPES", "SIGNALS", "SIGNAL_TYPES", "TIME", "Layer", "flat", "number", "scalar", "signal"]

TIME = Variable("time", 0, "Real", "local", "fixed", "", "s", {"s": 1})
_ANGLE = Variable("phase", 0, "Real", "local", "fixed", "", "rad", {"rad": 1})
# Signals given as a table: entry -> kind of number, and its default where it may be left out.
SHAPES: dict[str, dict[str, tuple[str, float | None]]] = {
    "sine": {
        "offset": ("value", 0.0),
        "amplitude": ("difference", None),
        "period": ("length", None),
        "phase": ("angle", 0.0),
    },
    "impulse": {"peak": ("value", None), "width": ("length", None), "start": ("time", 0.0)},
    "pulses": {
        "low": ("value", 0.0),
        "high": ("value", None),
        "width": ("length", None),
        "period": ("length", None),
        "count": ("count", None),
        "start": ("time", 0.0),
    },
}
SIGNALS = ("steps", "ramps", "table", *SHAPES)
SIGNAL_TYPES = (Constant, Steps, Ramps, Sine, Impulse)  # signals that Python hands over as they are
_BARE_LIST = re.compile(r"\[[^\[\]]*\]")  # what --set leaves of a list that is not TOML
_COMMA = re.compile(r"\s*[-+]?\d+,\d")
MOST_TURNS = 1.0  # of an angle; a larger number without a unit may be meant in degrees
COLD = 150.0  # [K] where silicone is glass
LEAST_NOMINAL = 200.0  # [K] of variables that are temperatures; those of smaller nominal may be differences
ZERO_CELSIUS = 273.15  # [K]
MAX_PULSES = 100_000  # of a train: two events each, which a run steps to one by one


def _is_signal(value: Mapping[str, Any]) -> bool:
    return any(kind in value for kind in SIGNALS) or ("file" in value and not {"column", "columns"}.isdisjoint(value))


def flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted names and values of nested tables; a table that is a signal stays whole."""
    for key, value in table.items():
        if isinstance(value, Mapping) and not _is_signal(value):
            yield from flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def number(layer: Layer, key: str, raw: Any, variable: Variable, difference: bool = False) -> float:
    """Read a finite number in the variable's unit; its range is checked unless it is a difference.

    Raises SceneError.
    """
    if isinstance(raw, bool) or not isinstance(raw, (int, float, str)):
        example = "" if variable.unit == "1" else f", or a text with a unit, such as '1 {variable.unit}'"
        layer.refuse(key, raw, f"wrong type; give a number in {variable.unit!r}{example}")
    if isinstance(raw, str) and _BARE_LIST.fullmatch(raw):
        items = ", ".join(repr(item.strip().strip("'\"")) for item in raw[1:-1].split(","))
        layer.refuse(key, raw, f"not a list; put its texts in quotes: [{items}]")
    if isinstance(raw, str) and _COMMA.match(raw):
        layer.refuse(key, raw, f"not a number with a unit; write a point: {raw.replace(',', '.', 1)!r}")
    try:
        value = (
            units.convert(
                raw,
                variable.dimension if variable.has_unit else {},
                variable.unit,
                difference or variable.relative,
                variable.factor,
                variable.offset,
            )
            if isinstance(raw, str)
            else float(raw)
        )
    except (ValueError, OverflowError) as error:
        layer.refuse(key, raw, f"{error}; give a number in {variable.unit!r} or a text with a unit that converts to it")
    if not math.isfinite(value):
        layer.refuse(key, raw, "not finite; give a finite number")
    if not difference:
        _in_range(layer, key, raw, value, variable)
        if isinstance(raw, (int, float)):
            _doubt_cold(layer, key, value, variable)
        if variable.unit == "rad" and abs(value) > MOST_TURNS * 2.0 * math.pi and not _states_a_unit(raw):
            text = (
                f"{layer.origin}: {key} = {raw}: rad, which is {value / (2.0 * math.pi):.3g} turns; write '{raw} deg'"
            )
            warnings.warn(f"{text} if meant", SceneWarning, stacklevel=2)
    return value


def _states_a_unit(raw: Any) -> bool:
    return isinstance(raw, str) and any(character.isalpha() for character in raw.replace("e", ""))


def _doubt_cold(layer: Layer, key: str, value: float, variable: Variable) -> None:
    """Warn of a number without a unit that is far too cold in kelvin: it may be meant in degrees Celsius."""
    if variable.unit != "K" or variable.relative or variable.nominal < LEAST_NOMINAL or not 0.0 <= value < COLD:
        return
    text = (
        f"{layer.origin}: {key} = {value:g}: K, which is {value - ZERO_CELSIUS:g} degC; write '{value:g} degC' if meant"
    )
    warnings.warn(text, SceneWarning, stacklevel=2)


def scalar(layer: Layer, key: str, raw: Any, variable: Variable) -> float | int | bool | str:
    """Read a constant of the variable's type; an enumeration's item becomes its value. Raises SceneError."""
    if variable.type == "Real":
        return number(layer, key, raw, variable)
    if variable.type == "Boolean":
        if not isinstance(raw, bool):
            layer.refuse(key, raw, "wrong type; allowed: true, false")
        return raw
    if variable.type == "String":
        if not isinstance(raw, str):
            layer.refuse(key, raw, "wrong type; give a text")
        return raw
    if variable.type == "Enumeration" and isinstance(raw, str):
        if raw not in variable.items:
            layer.refuse(key, raw, similar(raw, variable.items))
        return variable.item_value(raw)
    if isinstance(raw, bool) or not isinstance(raw, int):
        allowed = f"allowed: {_items(variable)}" if variable.items else "give a whole number"
        layer.refuse(key, raw, f"wrong type; {allowed}")
    if variable.items:
        if raw not in variable.item_values:
            layer.refuse(key, raw, f"not the value of an item; allowed: {_items(variable)}")
        return raw
    _in_range(layer, key, raw, raw, variable)
    return raw


def _items(variable: Variable) -> str:
    """Items of an enumeration, with their values where these are not 1, 2, ..."""
    if variable.item_values == tuple(range(1, len(variable.items) + 1)):
        return ", ".join(variable.items)
    return ", ".join(f"{name} ({value})" for name, value in zip(variable.items, variable.item_values, strict=True))


def signal(layer: Layer, key: str, raw: Any, variable: Variable) -> Signal:
    """Read a signal.

    It is a constant, {steps = [[t, value], ...]}, {ramps = [[t, value], ...]}, or a table of SHAPES: {sine = {offset,
    amplitude, period, phase}}, {impulse = {peak, width}}, {pulses = {high, width, period, count}}, or {table = {file,
    column}} (columns.py), in short {file, column, hold}.

    Integer, Boolean and enumeration variables take constants and steps. Raises SceneError.
    """
    if isinstance(raw, SIGNAL_TYPES):
        for value in raw.extremes:
            _in_range(layer, key, type(raw).__name__, value, variable)
        return raw
    if not isinstance(raw, Mapping):
        return Constant(float(scalar(layer, key, raw, variable)))
    given, is_short = dict(raw), "file" in raw and "column" in raw
    if is_short:
        raw = {"table": {"interpolation" if entry == "hold" else entry: value for entry, value in raw.items()}}
    if variable.type == "String":
        layer.refuse(key, dict(raw), "the variable is a String, which is constant; give a text")
    if len(raw) != 1 or next(iter(raw)) not in SIGNALS:
        layer.refuse(key, dict(raw), f"not a signal; give a constant or one of {', '.join(SIGNALS)}")
    ((kind, content),) = raw.items()
    if variable.type != "Real" and kind != "steps":
        layer.refuse(key, dict(raw), f"the variable is {variable.type}, so it cannot follow {kind}; give steps")
    if kind in SHAPES:
        return _shaped(layer, key, kind, content, variable)
    if kind == "table":
        try:
            return column_signal(content, layer.folder, variable, is_short)
        except ValueError as error:
            layer.refuse(key, given if is_short else content, str(error))
    pairs: list[Any] = content if isinstance(content, list) and content else [None]
    if not all(isinstance(pair, list) and len(pair) == 2 for pair in pairs):
        layer.refuse(key, content, f"give {kind} as a list of pairs [time, value]")
    times = tuple(number(layer, key, pair[0], TIME) for pair in pairs)
    if any(b <= a for a, b in itertools.pairwise(times)):
        layer.refuse(key, content, "times must increase; sort the pairs, one for each time")
    values = tuple(float(scalar(layer, key, pair[1], variable)) for pair in pairs)
    return Steps(times, values) if kind == "steps" else Ramps(times, values)


def _shaped(layer: Layer, key: str, kind: str, content: Any, variable: Variable) -> Signal:
    """Read a signal that is given as a table of numbers."""
    shape = SHAPES[kind]
    if not isinstance(content, Mapping):
        layer.refuse(key, content, f"give {kind} as a table with {', '.join(shape)}")
    for name in content:
        if name not in shape:
            layer.refuse(f"{key}.{kind}.{name}", content[name], f"unknown; {similar(name, tuple(shape))}")
    for name, (_, default) in shape.items():
        if name not in content and default is None:
            layer.refuse(key, dict(content), f"{kind} without {name}; add it")
    entries = {n: _entry(layer, key, n, what, content.get(n, start), variable) for n, (what, start) in shape.items()}
    if kind == "pulses":
        if entries["width"] >= entries["period"]:
            layer.refuse(key, dict(content), "pulses overlap; make width shorter than period")
        count = int(entries.pop("count"))
        return pulses(**entries, count=count)
    shaped = Sine(**entries) if kind == "sine" else Impulse(**entries)
    for value in shaped.extremes:
        _in_range(layer, key, dict(content), value, variable)
    return shaped


def _entry(layer: Layer, key: str, name: str, what: str, raw: Any, variable: Variable) -> float:
    if what == "count":
        if isinstance(raw, bool) or not isinstance(raw, int) or not 1 <= raw <= MAX_PULSES:
            layer.refuse(key, raw, f"give {name} as a whole number from 1 to {MAX_PULSES}")
        return raw
    if what in ("value", "difference"):
        return number(layer, key, raw, variable, difference=what == "difference")
    value = number(layer, key, raw, _ANGLE if what == "angle" else TIME)
    if what == "length" and value <= 0.0:
        layer.refuse(key, raw, f"{name} must be positive; give a time greater than 0")
    if what == "time" and value < 0.0:
        layer.refuse(key, raw, f"{name} is before the run; allowed: 0 s or later")
    return value


def _in_range(layer: Layer, key: str, raw: Any, value: float, variable: Variable) -> None:
    if not variable.least <= value <= variable.most:
        unit = "" if variable.unit == "1" else f" {variable.unit}"
        layer.refuse(key, raw, f"out of range; allowed: {variable.least:g} to {variable.most:g}{unit}")
