"""Results beyond the limits of plausibility of their scene, by quantity, amount, time and TCA."""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np

from ..scene import Scene
from ..scene.manipulator import ROD, TEMPERATURE, THERMAL, VOLTAGE
from .table import ResultLike

__all__ = ["doubtful"]

ZERO_CELSIUS = 273.15  # [K]
_HOTTEST, _VELOCITY = "T_max", "tip.v"


def doubtful(scene: Scene, result: ResultLike) -> list[str]:
    """Return one text for each limit that a result exceeds."""
    members = json.loads(result.attrs.get("members", "{}"))
    thermal, rod = scene.model(THERMAL), scene.model(ROD)
    texts: list[str] = []
    if thermal and thermal.name in members:
        texts += _temperature(result, thermal.name, scene.limits.temperature)
    if thermal and rod and rod.name in members and np.any(result[f"{thermal.name}.{VOLTAGE}"].to_numpy()):
        texts += _speed(result, rod.name, scene.limits.speed)
    return texts


def _temperature(result: ResultLike, member: str, limit: float) -> Iterator[str]:
    if f"{member}.{_HOTTEST}" not in result or f"{member}.{TEMPERATURE}" not in result:
        return
    hottest = result[f"{member}.{_HOTTEST}"].to_numpy()
    beyond = np.flatnonzero(hottest > limit)
    if beyond.size:
        row = int(beyond[0])
        tca = int(np.argmax(result[f"{member}.{TEMPERATURE}"].to_numpy()[row])) + 1
        time, most = float(result["time"].to_numpy()[row]), float(hottest.max()) - ZERO_CELSIUS
        yield (
            f"{member}: TCA {tca} is hotter than {limit - ZERO_CELSIUS:g} degC from t = {time:g} s on (up to "
            f"{most:.0f} degC): its material does not stand that; lower the voltages, or set limits.temperature"
        )


def _speed(result: ResultLike, member: str, limit: float) -> Iterator[str]:
    if f"{member}.{_VELOCITY}" not in result:
        return
    speeds = np.linalg.norm(result[f"{member}.{_VELOCITY}"].to_numpy(), axis=1)
    beyond = np.flatnonzero(speeds > limit)
    if beyond.size:
        time, most = float(result["time"].to_numpy()[int(beyond[0])]), float(speeds.max())
        yield (
            f"{member}: the tip is faster than {limit:g} m/s from t = {time:g} s on (up to {most:.2g} m/s), so that "
            "the heat transfer from the surface is not constant; slow the motion down, or set limits.speed"
        )
