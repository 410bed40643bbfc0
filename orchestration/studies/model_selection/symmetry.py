"""Symmetry plane of a scene: a plane through the rod's axis in which TCAs, heating and loads mirror.

A rod that starts straight, or at equilibrium in that plane, stays in it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from ...cosim.signals import Constant, Signal
from ...scene import Member, Scene
from ...scene.manipulator import ROD, THERMAL, RodParameters

__all__ = ["symmetry_plane"]

_SAME = 1e-9  # largest difference of equal angles [rad], and largest share of a load across the plane


def symmetry_plane(scene: Scene) -> float | None:
    """Azimuth of the symmetry plane from the x axis [rad], in [0, pi); None where the scene has none."""
    rod = scene.model(ROD)
    if rod is None or not _straight(rod):
        return None
    azimuths = RodParameters.of(rod).geometry.azimuth
    heats = _heats(scene, rod, len(azimuths))
    for angle in sorted(_candidates(azimuths), key=lambda a: (round(a / (math.pi / 2.0), 9) % 1.0 > 0.0, a)):
        if _mirrors(azimuths, heats, angle) and _lies_in(rod, angle):
            return angle
    return None


def _straight(rod: Member) -> bool:
    p = RodParameters.of(rod)
    return p.profile == "round" and not any((*p.helix, *p.curvature))


def _heats(scene: Scene, rod: Member, count: int) -> list[object]:
    """What decides the temperature of each TCA; equal where the temperatures are equal."""
    thermal = scene.model(THERMAL)
    heats: list[object] = []
    for i in range(1, count + 1):
        temperature = rod.signals.get(f"T[{i}]")
        voltage = thermal.signals.get(f"V[{i}]", Constant(0.0)) if thermal else None
        resistance = thermal.value(f"tca.R[{i}]") if thermal else None
        heats.append((temperature, voltage, resistance))
    return heats


def _candidates(azimuths: Sequence[float]) -> Iterator[float]:
    """Azimuths of possible mirror planes: through one TCA or between two, and normal to these."""
    for a in azimuths:
        for b in azimuths:
            for turn in (0.0, math.pi / 2.0):
                yield _folded(0.5 * (a + b) + turn)


def _mirrors(azimuths: Sequence[float], heats: list[object], angle: float) -> bool:
    """Whether every TCA has one at its mirror image that is heated alike."""
    return all(
        any(
            abs(math.remainder(2.0 * angle - a - b, 2.0 * math.pi)) < _SAME and h == g
            for b, g in zip(azimuths, heats, strict=True)
        )
        for a, h in zip(azimuths, heats, strict=True)
    )


def _lies_in(rod: Member, angle: float) -> bool:
    """Whether forces act along the plane and moments about its normal."""
    across = (-math.sin(angle), math.cos(angle), 0.0)
    along = ((math.cos(angle), math.sin(angle), 0.0), (0.0, 0.0, 1.0))
    return all(_has_no_component(rod, vector, across) for vector in ("gravity", "tip_force")) and all(
        _has_no_component(rod, "tip_moment", direction) for direction in along
    )


def _has_no_component(rod: Member, vector: str, direction: tuple[float, float, float]) -> bool:
    """Whether a vector input has no component along a direction at any time; signals of unlike shape cannot cancel."""
    parts: list[tuple[float, Signal]] = []
    for share, name in zip(direction, rod.archive.vectors[vector], strict=True):
        signal = rod.signals.get(name)
        if abs(share) > _SAME and signal is not None and any(signal.extremes):
            parts.append((share, signal))
    constant = [(share, signal.value) for share, signal in parts if isinstance(signal, Constant)]
    if len(constant) < len(parts):
        return False
    size = max((abs(value) for _, value in constant), default=0.0)
    return abs(sum(share * value for share, value in constant)) <= _SAME * size


def _folded(angle: float) -> float:
    """The angle modulo pi [rad], 0 where it is pi to rounding."""
    folded = angle % math.pi
    return 0.0 if math.pi - folded < _SAME else folded
