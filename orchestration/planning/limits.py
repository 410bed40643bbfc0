"""Limits of a plan."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import SceneError

__all__ = ["PlanLimits"]

_UNITS = {"voltage": "V", "temperature": "K", "hottest": "K", "voltage_rate": "V/s"}


@dataclass(frozen=True)
class PlanLimits:
    """What a plan must keep at all times.

    Attributes
    ----------
    voltage : float
        Largest voltage [V]; the least is 0.
    temperature : float
        Highest mean temperature of a TCA [K].
    hottest : float
        Highest temperature anywhere in the TCAs and on the surface [K].
    voltage_rate : float
        Fastest change of a voltage [V/s], as change from knot to knot over their distance; inf: none.

    Raises
    ------
    SceneError
        A limit is not positive.
    """

    voltage: float = 5.0
    temperature: float = 373.15
    hottest: float = 373.15
    voltage_rate: float = math.inf

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0.0 or (name != "voltage_rate" and not math.isfinite(value)):
                raise SceneError(f"limit {name} = {value:g} {_UNITS[name]}: give a positive number")
