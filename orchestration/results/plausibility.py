"""Results beyond the limits of plausibility of their scene, by quantity, amount, time and TCA."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..scene import Member, Scene
from ..scene.manipulator import DISPLACEMENT, ROD, TEMPERATURE, THERMAL, VOLTAGE
from .table import ResultLike

__all__ = ["doubtful"]

ZERO_CELSIUS = 273.15  # [K]
_HOTTEST, _VELOCITY, _LENGTH = "T_max", "tip.v", "body.length"


def doubtful(scene: Scene, result: ResultLike) -> list[str]:
    """Return one text for each limit that a result exceeds."""
    sections = [m for m in scene.models(THERMAL) if f"{m.name}.{VOLTAGE}" in result]
    is_heated = any(np.any(result[f"{thermal.name}.{VOLTAGE}"].to_numpy()) for thermal in sections)
    texts: list[str] = []
    for thermal in sections:
        texts += _temperature(result, thermal.name, scene.limits.temperature)
    for rod in scene.models(ROD):
        if is_heated:
            texts += _speed(result, rod.name, scene.limits.speed)
        texts += _strain(result, rod, scene.limits.strain)
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


def _strain(result: ResultLike, rod: Member, limit: float) -> Iterator[str]:
    if f"{rod.name}.{DISPLACEMENT}" not in result or _LENGTH not in rod.archive.variables:
        return
    strains = np.abs(result[f"{rod.name}.{DISPLACEMENT}"].to_numpy()) / rod.real(_LENGTH)
    beyond = np.flatnonzero(np.max(strains, axis=1) > limit)
    if beyond.size:
        row = int(beyond[0])
        time, most = float(result["time"].to_numpy()[row]), float(strains.max())
        yield (
            f"{rod.name}: the body is strained along TCA {int(np.argmax(strains[row])) + 1} by more than "
            f"{100.0 * limit:g} % from t = {time:g} s on (up to {100.0 * most:.0f} %), where it is not linear elastic; "
            "lower voltages or loads, or set limits.strain"
        )
