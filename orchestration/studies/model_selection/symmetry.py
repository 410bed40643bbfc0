"""Symmetry plane of a scene: a plane through the rod's axis in which TCAs, heating and loads mirror.

A rod that starts straight, or at equilibrium in that plane, stays in it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from ...cosim.signals import Constant, Signal
from ...scene import Member, Scene
from ...scene.body import RodParameters
from ...scene.manipulator import ROD

__all__ = ["symmetry_plane"]

_AZIMUTH = "tca.azimuth["  # where a TCA lies in its section: mirrored like that of the rod
_SAME = 1e-9  # largest difference of equal angles [rad], and largest share of a load across the plane


def symmetry_plane(scene: Scene) -> float | None:
    """Azimuth of the symmetry plane from the x axis [rad], in [0, pi); None where the scene has none, or two rods."""
    rods = scene.models(ROD)
    if len(rods) != 1 or not _straight(rods[0]):
        return None
    rod = rods[0]
    body = RodParameters.of(rod)
    azimuths = body.azimuth
    heats = [*zip(_heats(scene, rod, len(azimuths)), (tca.behaviour for tca in body.tcas), strict=True)]
    for angle in sorted(_candidates(azimuths), key=lambda a: (round(a / (math.pi / 2.0), 9) % 1.0 > 0.0, a)):
        if _mirrors(azimuths, heats, angle) and _lies_in(rod, angle):
            return angle
    return None


def _straight(rod: Member) -> bool:
    p = RodParameters.of(rod)
    curved = any(any(segment.curvature) for segment in p.segments)
    wound = any(tca.helix for tca in p.tcas)  # and TCAs whose ends are held twist the body
    centred = not p.tip_body.mass or not any(p.tip_body.centre[:2])
    return p.profile == "round" and p.ends == "free" and centred and not curved and not wound


def _heats(scene: Scene, rod: Member, count: int) -> list[object]:
    """What decides the temperature of each TCA; equal where the temperatures are equal."""
    members = {member.name: member for member in scene.members}
    heats: list[object] = []
    for i in range(1, count + 1):
        wires = [c for c in scene.connections if c.target == (rod.name, f"T[{i}]")]
        sources = sorted((_heating(members[c.source[0]], c.source[1], c.factor, c.offset) for c in wires), key=repr)
        heats.append((rod.signals.get(f"T[{i}]"), *sources))
    return heats


def _heating(source: Member, output: str, factor: float, offset: float) -> object:
    """Member, parameters and signals behind a temperature: those with the index of its element."""
    index = output.partition("[")[2]
    variables = source.archive.variables.values() if index else ()
    own = [v for v in variables if v.causality in ("parameter", "input") and v.name.partition("[")[2] == index]
    values = tuple(
        source.signals.get(v.name, Constant(source.real(v.name))) if v.causality == "input" else source.value(v.name)
        for v in own
        if not v.name.startswith(_AZIMUTH)
    )
    return source.name, values if index else output, factor, offset


def _candidates(azimuths: Sequence[float]) -> Iterator[float]:
    """Azimuths of possible mirror planes: through one TCA or between two, and normal to these."""
    for a in azimuths:
        for b in azimuths:
            for turn in (0.0, math.pi / 2.0):
                yield _folded(0.5 * (a + b) + turn)


def _mirrors(azimuths: Sequence[float], heats: Sequence[object], angle: float) -> bool:
    """Whether every TCA has one at its mirror image that is heated alike and has the same law and routing."""
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
