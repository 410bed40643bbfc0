"""What a scene asks of the reference: its parameters, and its inputs as functions of time. Numbers come from the scene
and from the start values that the FMUs declare; nothing of the FMUs' binaries is used."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...cosim.signals import Constant, Signal
from ...errors import SceneError
from ...scene import Member, Scene
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
    return heat_data_of(thermal.real, thermal.reals)


def heat_data_of(value: Callable[[str], float], elements: Callable[[str], Sequence[float]]) -> HeatData:
    """value, elements: of a parameter, and of a vector of them, by name."""
    return HeatData(
        section=Section(
            value("body.radius"),
            value("tca.outer_radius"),
            value("tca.inner_radius"),
            value("tca.offset"),
            tuple(elements("tca.azimuth")),
        ),
        length=value("body.length"),
        body_k=value("body.k"),
        body_rho_c=value("body.rho_c"),
        tca_k=value("tca.k"),
        tca_rho_c=value("tca.rho_c"),
        transfer=value("h"),
        resistance=tuple(elements("tca.R")),
        alpha=value("tca.alpha_T"),
        T_ref=value("tca.T_ref"),
        T_0=value("T_0"),
    )


def rod_data(rod: Member) -> RodData:
    """Whatever strains and closure the scene chooses: all six strains, and the TCAs' law inside."""
    if rod.choice("tca.pitch") == "current":
        raise SceneError(f"reference: {rod.name}.tca.pitch = 'current' is not covered; allowed: 'frozen'")
    v = rod.real
    radius, length, E = v("body.radius"), v("body.length"), v("body.E")
    area, second, G = np.pi * radius**2, np.pi * radius**4 / 4, E / (2 * (1 + v("body.nu")))
    shear = v("body.shear_factor") * G * area
    round_rod = np.array([E * second, E * second, 2 * G * second, shear, shear, E * area])
    wire = WireLaw(
        length=v("tca.wire_length"),
        coiled=length,
        diameter=v("tca.wire_diameter"),
        coils=v("tca.coils"),
        twists=v("tca.twists"),
        E=v("tca.E"),
        expansion=v("tca.rho_T"),
    )
    measured = rod.choice("tca.law") == "measured"
    return RodData(
        length=length,
        stiffness=np.array(rod.reals("body.stiffness")) if rod.choice("body.profile") == "given" else round_rod,
        rest=np.array([*rod.reals("body.curvature"), 0.0, 0.0, 1.0]),
        inertia=v("body.rho") * np.array([second, second, 2 * second, area, area, area]),
        retardation=v("body.retardation"),
        offset=v("tca.offset"),
        azimuth=np.array(rod.reals("tca.azimuth")),
        helix=np.array(rod.reals("tca.helix")),
        tca_stiffness=v("tca.stiffness") if measured else 1.0 / wire.f1,
        law=v("tca.stroke") if measured else wire,
        chirality=int(v("tca.chirality")),
        T_0=v("T_0"),
    )
