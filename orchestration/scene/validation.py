"""Raw TOML values against the variables that an FMU declares; every refusal names file, line, key, value, what is
allowed and the remedy."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

from ..cosim.signals import Constant, Impulse, Ramps, Signal, Sine, Steps, pulses
from ..errors import SceneError
from ..fmi import units
from ..fmi.archive import Variable, similar

__all__ = ["SHAPES", "SIGNALS", "TIME", "Layer", "number", "scalar", "signal"]

TIME = Variable("time", 0, "Real", "local", "fixed", "", "s", {"s": 1})
_ANGLE = Variable("phase", 0, "Real", "local", "fixed", "", "rad", {"rad": 1})
# Signals given as a table: entry -> what it is, and its default where it may be left out.
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
SIGNALS = ("steps", "ramps", *SHAPES)
MOST_PULSES = 100_000


@dataclass(frozen=True)
class Layer:
    """One source of raw values: a parameter set, a scene file, overrides. Later layers win."""

    origin: str
    text: str
    raw: Mapping[str, Any]
    numbered: bool = True  # whether the text has lines to name

    def refuse(self, key: str, value: Any, problem: str) -> NoReturn:
        shown = "" if value is None else f" = {value!r}"
        raise SceneError(f"{self.origin}{self._line(key)}: {key}{shown}: {problem}")

    def _line(self, key: str) -> str:
        """':n' where the key (table.name[i]) is written, as far as a plain look at the lines tells."""
        if not self.numbered:
            return ""
        table, _, name = key.partition(".")
        name = re.split(r"\[\d", name)[0] if name else table
        inside = not key.partition(".")[2]
        for n, line in enumerate(self.text.splitlines(), 1):
            if header := re.match(r"\s*\[+\s*([^\]]+?)\s*\]+", line):
                inside = header[1].strip('"') == table
                if inside and not name:
                    return f":{n}"
            elif inside and re.match(rf'\s*"?{re.escape(name)}(\[\d+\])?"?\s*=', line):
                return f":{n}"
        return ""


def number(layer: Layer, key: str, raw: Any, variable: Variable, difference: bool = False) -> float:
    """A finite number in the variable's unit; its range is checked unless it is a difference of two values."""
    if isinstance(raw, bool) or not isinstance(raw, (int, float, str)):
        layer.refuse(
            key,
            raw,
            f"wrong type; give a number in {variable.unit!r} or a text with a unit, such as '1 {variable.unit}'",
        )
    try:
        value = (
            units.convert(
                raw,
                variable.dimension,
                variable.unit,
                difference or variable.relative,
                variable.factor,
                variable.offset,
            )
            if isinstance(raw, str)
            else float(raw)
        )
    except ValueError as error:
        layer.refuse(key, raw, f"{error}; give a number in {variable.unit!r} or a unit that converts to it")
    if not math.isfinite(value):
        layer.refuse(key, raw, "not finite; give a finite number")
    if not difference:
        _in_range(layer, key, raw, value, variable)
    return value


def scalar(layer: Layer, key: str, raw: Any, variable: Variable) -> float | int | bool | str:
    """A constant of the variable's type; an item's name becomes its index."""
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
        allowed = f"allowed: {', '.join(variable.items)}" if variable.items else "give a whole number"
        layer.refuse(key, raw, f"wrong type; {allowed}")
    if variable.items and raw not in variable.item_values:
        known = (f"{name} ({value})" for name, value in zip(variable.items, variable.item_values, strict=True))
        layer.refuse(key, raw, f"allowed: {', '.join(known)}")
    _in_range(layer, key, raw, raw, variable)
    return raw


def signal(layer: Layer, key: str, raw: Any, variable: Variable) -> Signal:
    """A constant, {steps = [[t, value], ...]}, {ramps = [[t, value], ...]}, or a table of SHAPES: {sine = {offset,
    amplitude, period, phase}}, {impulse = {peak, width}}, {pulses = {high, width, period, count}}."""
    if not isinstance(raw, Mapping):
        return Constant(float(scalar(layer, key, raw, variable)))
    if len(raw) != 1 or next(iter(raw)) not in SIGNALS:
        layer.refuse(key, dict(raw), f"not a signal; give a constant or one of {', '.join(SIGNALS)}")
    ((kind, about),) = raw.items()
    if kind in SHAPES:
        return _shaped(layer, key, kind, about, variable)
    if not (isinstance(about, list) and about and all(isinstance(pair, list) and len(pair) == 2 for pair in about)):
        layer.refuse(key, about, f"{kind} wants a list of pairs [time, value]")
    times = tuple(number(layer, key, pair[0], TIME) for pair in about)
    if any(b <= a for a, b in itertools.pairwise(times)):
        layer.refuse(key, about, "times must increase")
    values = tuple(number(layer, key, pair[1], variable) for pair in about)
    return Steps(times, values) if kind == "steps" else Ramps(times, values)


def _shaped(layer: Layer, key: str, kind: str, about: Any, variable: Variable) -> Signal:
    """A signal that is given as a table of numbers."""
    shape = SHAPES[kind]
    if not isinstance(about, Mapping):
        layer.refuse(key, about, f"{kind} wants a table with {', '.join(shape)}")
    for name in about:
        if name not in shape:
            layer.refuse(f"{key}.{kind}.{name}", about[name], f"unknown; {similar(name, tuple(shape))}")
    for name, (_, default) in shape.items():
        if name not in about and default is None:
            layer.refuse(key, dict(about), f"{kind} without {name}; add it")
    given = {n: _entry(layer, key, n, what, about.get(n, default), variable) for n, (what, default) in shape.items()}
    if kind == "pulses":
        if given["width"] >= given["period"]:
            layer.refuse(key, dict(about), "pulses overlap; make width shorter than period")
        count = int(given.pop("count"))
        return pulses(**given, count=count)
    made = Sine(**given) if kind == "sine" else Impulse(**given)
    for value in made.extremes:
        _in_range(layer, key, dict(about), value, variable)
    return made


def _entry(layer: Layer, key: str, name: str, what: str, raw: Any, variable: Variable) -> float:
    if what == "count":
        if isinstance(raw, bool) or not isinstance(raw, int) or not 1 <= raw <= MOST_PULSES:
            layer.refuse(key, raw, f"{name} wants a whole number from 1 to {MOST_PULSES}")
        return raw
    if what in ("value", "difference"):
        return number(layer, key, raw, variable, difference=what == "difference")
    found = number(layer, key, raw, _ANGLE if what == "angle" else TIME)
    if what == "length" and found <= 0.0:
        layer.refuse(key, raw, f"a {name} is positive")
    if what == "time" and found < 0.0:
        layer.refuse(key, raw, f"{name} is before the run; allowed: 0 s or later")
    return found


def _in_range(layer: Layer, key: str, raw: Any, value: float, variable: Variable) -> None:
    if not variable.least <= value <= variable.most:
        unit = "" if variable.unit == "1" else f" {variable.unit}"
        layer.refuse(key, raw, f"out of range; allowed: {variable.least:g} to {variable.most:g}{unit}")
