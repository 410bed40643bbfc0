"""The body that a rod FMU describes: segments, TCAs one by one, what holds them, and the rigid body at the tip.

Report, animation, checks, reference solution and studies read it here, so that all of them see the same body.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any, TypeVar

import numpy as np

from .manipulator import Parameters

__all__ = ["RodParameters", "SegmentParameters", "TcaParameters", "TipBody"]

_Record = TypeVar("_Record", "SegmentParameters", "TcaParameters")


@dataclass(frozen=True)
class SegmentParameters:
    """One segment of the body, SI units. stiffness holds where the profile of the body is "given"."""

    length: float  # [m]
    radius: float  # at its start [m]
    radius_end: float  # at its end, linear between [m]
    E: float  # Young's modulus [Pa]
    nu: float  # Poisson's ratio
    rho: float  # density [kg/m3]
    shear_factor: float
    retardation: float  # [s]
    stiffness: tuple[float, ...]  # (6,) [N.m2, N.m2, N.m2, N, N, N]
    curvature: tuple[float, ...]  # (3,) of the unloaded segment [1/m]

    @property
    def is_tapered(self) -> bool:
        """Whether the radius at the end is another than that at the start."""
        return self.radius != self.radius_end


@dataclass(frozen=True)
class TcaParameters:
    """Routing and law of a TCA, SI units.

    wire_* down to expansion hold where the law is "wire", stiffness and what follows where it is "measured".
    """

    azimuth: float  # [rad]
    helix: float  # [rad/m]
    offset: float  # from the centreline at the start of its span [m]
    offset_end: float  # at the end of its span, linear between [m]
    first_segment: int
    last_segment: int
    law: str  # wire, measured
    pitch: str  # frozen, current
    chirality: int
    handedness: int
    wire_length: float  # [m]
    wire_diameter: float  # [m]
    coils: float
    twists: float
    E: float  # Young's modulus of the wire [Pa]
    expansion: float  # rho_T of the wire's diameter [1/K]
    stiffness: float  # [N/m]
    stiffening: float  # [N/m2]
    stroke: float  # [m/K]
    stroke_curvature: float  # [m/K2]
    stop: float  # [m]
    stop_width: float  # [m]
    stop_stiffness: float  # [N/m]
    creep_compliance: float  # [m/N]; 0 where it does not creep

    @property
    def behaviour(self) -> TcaParameters:
        """The TCA without its azimuth: equal for TCAs that differ in nothing but where they lie."""
        return replace(self, azimuth=0.0)


@dataclass(frozen=True)
class TipBody:
    """Rigid body at the tip."""

    mass: float  # [kg]; 0 where there is none
    inertia: tuple[float, ...]  # (3,) about its centre, axes of the tip [kg.m2]
    centre: tuple[float, ...]  # (3,) from the tip, axes of the tip [m]


@dataclass(frozen=True)
class RodParameters:
    """Parameters of rod.fmu: the whole body."""

    segments: tuple[SegmentParameters, ...]
    tcas: tuple[TcaParameters, ...]
    tip_body: TipBody
    profile: str  # round, given
    contact: str  # sliding, bonded
    ends: str  # free, tethered
    T_0: float  # [K]

    @classmethod
    def of(cls, p: Parameters) -> RodParameters:
        """Read the parameters of a rod FMU."""
        count = len(p.reals("tca.azimuth"))
        values = cache(lambda name: p.each(f"tca.{name}", count))  # read once for all TCAs
        return cls(
            segments=_segments(p),
            tcas=tuple(_tca(p, i, values) for i in range(count)),
            tip_body=TipBody(p.real("tip_body.mass"), p.reals("tip_body.inertia"), p.reals("tip_body.centre")),
            profile=p.choice("body.profile"),
            contact=p.choice("tca.contact"),
            ends=p.choice("tca.ends"),
            T_0=p.real("T_0"),
        )

    @property
    def breaks(self) -> np.ndarray:
        """Ends of the segments from the clamp on [m], (M + 1,)."""
        return np.concatenate([[0.0], np.cumsum([segment.length for segment in self.segments])])

    @property
    def length(self) -> float:
        """Length of the body [m]."""
        return float(self.breaks[-1])

    @property
    def radius(self) -> float:
        """Largest radius of the body [m]."""
        return max(max(segment.radius, segment.radius_end) for segment in self.segments)

    @property
    def azimuth(self) -> tuple[float, ...]:
        """Azimuths of the TCAs at the clamp [rad], (N,)."""
        return tuple(tca.azimuth for tca in self.tcas)

    def span(self, tca: int) -> tuple[float, float]:
        """Where the span of a TCA (from 0) starts and ends along the body [m]."""
        breaks = self.breaks
        return float(breaks[self.tcas[tca].first_segment - 1]), float(breaks[self.tcas[tca].last_segment])

    def offset(self, tca: int, s: np.ndarray) -> np.ndarray:
        """Distances of a TCA from the centreline [m] at s (n,) [m] of its span."""
        start, end = self.span(tca)
        one = self.tcas[tca]
        return one.offset + (one.offset_end - one.offset) * (s - start) / (end - start)

    def differences_from_uniform(self) -> list[str]:
        """What makes the body another than one uniform segment with TCAs of the linear law over its whole length."""
        differences = []
        if any(segment != replace(self.segments[0], length=segment.length) for segment in self.segments):
            differences.append("segments that differ")
        if any(segment.is_tapered for segment in self.segments):
            differences.append("a radius that changes along the body")
        if any((tca.first_segment, tca.last_segment) != (1, len(self.segments)) for tca in self.tcas):
            differences.append("TCAs along a part of the body")
        if any(tca.offset != tca.offset_end for tca in self.tcas):
            differences.append("a distance of a TCA from the centreline that changes")
        if any(tca.law == "wire" and tca.pitch == "current" for tca in self.tcas):
            differences.append("tca.pitch = 'current'")
        if any(
            tca.law == "measured" and (tca.stiffening or tca.stroke_curvature or tca.stop_stiffness)
            for tca in self.tcas
        ):
            differences.append("a measured law that is not linear")
        if any(tca.creep_compliance for tca in self.tcas):
            differences.append("a TCA that creeps")
        differences += [f"tca.contact = {self.contact!r}"] * (self.contact != "sliding")
        differences += [f"tca.ends = {self.ends!r}"] * (self.ends != "free")
        differences += ["a body at the tip"] * (self.tip_body.mass > 0.0)
        return differences


def _segments(p: Parameters) -> tuple[SegmentParameters, ...]:
    lengths = p.reals("segment.length")
    count = len(lengths)
    owner = "body" if count == 1 else "segment"  # the vectors of the only segment are those of the body
    radii = np.reshape(p.reals("segment.radius"), (count, 2)).tolist()
    stiffness = np.reshape(p.reals(f"{owner}.stiffness"), (count, 6)).tolist()
    curvature = np.reshape(p.reals(f"{owner}.curvature"), (count, 3)).tolist()

    def segment(j: int) -> SegmentParameters:
        return _record(
            SegmentParameters,
            lambda name: p.each(f"segment.{name}", count)[j],
            length=lengths[j],
            radius=radii[j][0],
            radius_end=radii[j][1],
            stiffness=tuple(stiffness[j]),
            curvature=tuple(curvature[j]),
        )

    return tuple(map(segment, range(count)))


def _tca(p: Parameters, i: int, values: Callable[[str], tuple[float, ...]]) -> TcaParameters:
    """Return the parameters of one TCA; values: those of a parameter for all TCAs, by its name without 'tca.'."""
    whole = {name: int(values(name)[i]) for name in ("first_segment", "last_segment", "chirality", "handedness")}
    return _record(
        TcaParameters,
        lambda name: values(name)[i],
        **whole,
        law=p.choice(f"tca.law[{i + 1}]"),
        pitch=p.choice(f"tca.pitch[{i + 1}]"),
        expansion=values("rho_T")[i],
        creep_compliance=values("creep_compliance")[i] if p.has("tca.creep_compliance") else 0.0,
    )


def _record(kind: type[_Record], real: Callable[[str], float], **known: Any) -> _Record:
    """Make a record whose other fields are real parameters of the same name."""
    return kind(**known, **{each.name: real(each.name) for each in fields(kind) if each.name not in known})  # type: ignore[arg-type]
