"""Parameters and inputs of a scene for the reference solution.

Numbers come from the scene and from the start values in the FMUs' descriptions; their binaries are not
used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...cosim.signals import Constant, Signal
from ...errors import SceneError
from ...scene import Member, Scene
from ...scene.body import RodParameters, TcaParameters
from .rod import RodData, WireLaw

__all__ = ["Inputs", "breaks", "rod_data"]


@dataclass(frozen=True)
class Inputs:
    """Vector input as a function of time."""

    signals: tuple[Signal, ...]

    @classmethod
    def from_member(cls, owner: Member, name: str) -> Inputs:
        """Read the input `name` of a member: its signals, and its start values where it has no signal."""
        elements = owner.archive.vectors.get(name, (name,))
        return cls(tuple(owner.signals.get(e, Constant(owner.real(e))) for e in elements))

    def __call__(self, t: float, a: float, b: float) -> np.ndarray:
        """Evaluate at t in the stretch [a, b] without jumps; at its ends the values are the limits from inside."""
        direction = a + b - 2.0 * t  # the side of a jump is decided at the middle of (t, t + direction), that of (a, b)
        return np.array([signal.polynomial(t, direction or 1e-9 * (b - a))[0] for signal in self.signals])


def breaks(scene: Scene) -> np.ndarray:
    """Instants [s] inside the run at which an input jumps or has a kink."""
    times = {t for m in scene.members for signal in m.signals.values() for t in signal.breaks}
    return np.array(sorted(t for t in times if 0.0 < t < scene.stop_time))


def rod_data(rod: Member) -> RodData:
    """Parameters of the rod of a scene.

    The reference always has all six strains and solves the TCAs' law together with the rod, whatever strains and
    closure the scene chooses.

    Raises
    ------
    SceneError
        The scene chooses a law that the reference does not cover.
    """
    p = RodParameters.of(rod)
    if limits := p.differences_from_uniform():
        raise SceneError(
            f"reference: {rod.name} has {', '.join(limits)}; the reference solution is for one uniform segment with "
            "TCAs along all of it that slide and turn freely; leave the rod out of the comparison, or change it"
        )
    body, length = p.segments[0], p.length
    area, second, G = np.pi * body.radius**2, np.pi * body.radius**4 / 4, body.E / (2 * (1 + body.nu))
    shear = body.shear_factor * G * area
    round_rod = np.array([body.E * second, body.E * second, 2 * G * second, shear, shear, body.E * area])
    laws = tuple(_law(tca, length) for tca in p.tcas)
    return RodData(
        length=length,
        stiffness=np.array(body.stiffness) if p.profile == "given" else round_rod,
        rest=np.array([*body.curvature, 0.0, 0.0, 1.0]),
        inertia=body.rho * np.array([second, second, 2 * second, area, area, area]),
        retardation=body.retardation,
        offset=np.array([tca.offset for tca in p.tcas]),
        azimuth=np.array(p.azimuth),
        helix=np.array([tca.helix for tca in p.tcas]),
        tca_stiffness=np.array(
            [1.0 / law.f1 if isinstance(law, WireLaw) else tca.stiffness for law, tca in zip(laws, p.tcas, strict=True)]
        ),
        laws=laws,
        chirality=np.array([tca.chirality for tca in p.tcas]),
        T_0=p.T_0,
    )


def _law(tca: TcaParameters, length: float) -> WireLaw | float:
    """Law of a TCA along a body of that length [m]: of a wire, or the free stroke per kelvin [m/K]."""
    if tca.law == "measured":
        return tca.stroke
    return WireLaw(
        length=tca.wire_length,
        coiled=length,
        diameter=tca.wire_diameter,
        coils=tca.coils,
        twists=tca.twists,
        E=tca.E,
        expansion=tca.expansion,
    )
