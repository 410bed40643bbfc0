"""Inputs of a scene that are exchanged while it runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..cosim.signals import Constant, Polynomial, Signal
from ..errors import SceneError
from ..scene import Scene

__all__ = ["LiveInput", "held", "with_live_inputs"]


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


def held(key: str, value: Any) -> Constant:
    """Return a value as a signal that holds it. Raises SceneError, with the key, where it is no finite number."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not np.isfinite(number):
        raise SceneError(f"{key} = {value!r}: give a finite number, as many as it has elements, or a signal")
    return Constant(number)
