"""Inputs of a scene that are exchanged while it runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..cosim.signals import Constant, Polynomial, Signal
from ..errors import SceneError
from ..scene import Scene

__all__ = ["LiveInput", "number_of", "signals_of", "with_live_inputs"]


class LiveInput:
    """A signal that can be exchanged while the simulation runs."""

    def __init__(self, signal: Signal) -> None:
        self.signal = signal

    @property
    def degree(self) -> int:
        """Highest degree of its polynomials."""
        return self.signal.degree

    @property
    def breaks(self) -> tuple[float, ...]:
        """Times at which the value or its slope jumps [s]."""
        return self.signal.breaks

    @property
    def extremes(self) -> tuple[float, ...]:
        """Values that bound the signal."""
        return self.signal.extremes

    def polynomial(self, t: float, h: float) -> Polynomial:
        """Return the coefficients for a step from t of h [s]."""
        return self.signal.polynomial(t, h)


def with_live_inputs(scene: Scene, live: dict[tuple[str, str], LiveInput]) -> Scene:
    """Return the scene with every input that no connection feeds driven by an exchangeable signal, kept in `live`."""
    fed = {c.target for c in scene.connections}
    members = []
    for member in scene.members:
        signals: dict[str, Signal] = {}
        for variable in member.archive.variables.values():
            if variable.causality != "input" or (member.name, variable.name) in fed or variable.type == "String":
                continue
            signal = member.signals.get(variable.name, Constant(float(variable.start or 0.0)))
            signals[variable.name] = live[member.name, variable.name] = LiveInput(signal)
        members.append(replace(member, signals=signals))
    return replace(scene, members=tuple(members))


def signals_of(key: str, value: Any, count: int) -> list[Signal]:
    """Return what a key is set to as one signal for each of its elements.

    Raises
    ------
    SceneError
        With the key, where the value is no finite number, no signal, or not as many of them.
    """
    if hasattr(value, "polynomial"):
        return [value] * count
    try:
        items = np.ravel(value).tolist()
    except ValueError:  # rows of different lengths
        items = [value]
    if len(items) == 1:
        items *= count
    if len(items) != count:
        raise SceneError(f"{key}: {len(items)} values for {count} elements; give {count} or 1")
    return [item if hasattr(item, "polynomial") else _held(key, item) for item in items]


def number_of(value: Any) -> float:
    """Return a value as a number, nan where it is none."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return float("nan")


def _held(key: str, value: Any) -> Constant:
    number = number_of(value)
    if not np.isfinite(number):
        raise SceneError(f"{key} = {value!r}: give a finite number, as many as it has elements, or a signal")
    return Constant(number)
