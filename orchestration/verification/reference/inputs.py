"""What a scene asks of the reference: its parameters, and its inputs as functions of time. Numbers come from the scene
and from the start values that the FMUs declare; nothing of the FMUs' binaries is used."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...cosim.signals import Constant, Signal
from ...errors import SceneError
from ...scene import Member, Scene
from ...scene.manipulator import RodParameters, ThermalParameters
from .heat import HeatData
from .rod import RodData, WireLaw
from .section import Section

__all__ = ["Inputs", "breaks", "heat_data", "heat_data_of", "rod_data"]


@dataclass(frozen=True)
class Inputs:
    """Signals of a vector input."""

    signals: tuple[Signal, ...]

    @classmethod
    def of(cls, owner: Member, name: str) -> Inputs:
        elements = owner.archive.vectors.get(name, (name,))
        return cls(tuple(owner.signals.get(e, Constant(owner.real(e))) for e in elements))

    def __call__(self, t: float, a: float, b: float) -> np.ndarray:
        """Values at t in the stretch from a to b in which nothing jumps: at its ends the limits from inside."""
        towards = a + b - 2.0 * t  # the middle of (t, t + towards), which decides on jumps, is that of (a, b)
        return np.array([signal.polynomial(t, towards or 1e-9 * (b - a))[0] for signal in self.signals])


def breaks(scene: Scene) -> np.ndarray:
    """Times [s] inside the run at which an input jumps or bends."""
    found = {t for m in scene.members for signal in m.signals.values() for t in signal.breaks}
    return np.array(sorted(t for t in found if 0.0 < t < scene.stop_time))


def heat_data(thermal: Member) -> HeatData:
    """Data of the heat problem of a scene's thermal FMU."""
    return heat_data_of(ThermalParameters.of(thermal))


def heat_data_of(p: ThermalParameters) -> HeatData:
    """Data of the heat problem of a set of parameters."""
    return HeatData(
        section=Section(p.geometry.radius, p.outer_radius, p.inner_radius, p.geometry.offset, p.geometry.azimuth),
        length=p.geometry.length,
        body_k=p.body_k,
        body_rho_c=p.body_rho_c,
        tca_k=p.tca_k,
        tca_rho_c=p.tca_rho_c,
        transfer=p.transfer,
        resistance=p.resistance,
        alpha=p.alpha,
        T_ref=p.T_ref,
        T_0=p.T_0,
    )


def rod_data(rod: Member) -> RodData:
    """Data of a scene's rod, whatever strains and closure it chooses: all six strains, and the TCAs' law inside.

    Raises SceneError for what the reference does not cover."""
    p = RodParameters.of(rod)
    if p.pitch == "current":
        raise SceneError(f"reference: {rod.name}.tca.pitch = 'current' is not covered; allowed: 'frozen'")
    radius, length = p.geometry.radius, p.geometry.length
    area, second, G = np.pi * radius**2, np.pi * radius**4 / 4, p.E / (2 * (1 + p.nu))
    shear = p.shear_factor * G * area
    round_rod = np.array([p.E * second, p.E * second, 2 * G * second, shear, shear, p.E * area])
    wire = WireLaw(
        length=p.wire_length,
        coiled=length,
        diameter=p.wire_diameter,
        coils=p.coils,
        twists=p.twists,
        E=p.E_wire,
        expansion=p.expansion,
    )
    measured = p.law == "measured"
    return RodData(
        length=length,
        stiffness=np.array(p.stiffness) if p.profile == "given" else round_rod,
        rest=np.array([*p.curvature, 0.0, 0.0, 1.0]),
        inertia=p.rho * np.array([second, second, 2 * second, area, area, area]),
        retardation=p.retardation,
        offset=p.geometry.offset,
        azimuth=np.array(p.geometry.azimuth),
        helix=np.array(p.helix),
        tca_stiffness=p.tca_stiffness if measured else 1.0 / wire.f1,
        law=p.stroke if measured else wire,
        chirality=p.chirality,
        T_0=p.T_0,
    )
