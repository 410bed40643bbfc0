"""Dimensionless numbers of a scene, from which levels of models are proposed before anything is run.

L length, A area, EI bending stiffness, h heat transfer, k conductivity of the body, w1 first natural frequency
(clamped-free, body alone: TCAs make it stiffer, so this is the slowest):
    Biot          h R/k                          heat leaves slower than it spreads where small
    shear         12 EI/(ks G A L^2)             share of shear in what a tip force moves
    extension     EI/(E A L^2)
    gravity       rho A g L^3/EI                 2.8 bends a soft rod far; 7.84 buckles an upright one
    tip           F L^2/EI + M L/EI
    residual      |sin(x)/x|, x = w1 tau/2       vibration that a load which grows for tau leaves behind, share of its
                                                 deflection (undamped); below its envelope min(1, 1/x)
    phase         w1 times the macro step
    damping       w1 body.retardation/2          damping ratio of the first mode
    vibration     residual sqrt((1 - e^-x)/(2 x)), x = 2 damping w1 stop_time: rms of that vibration over the scene
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from ...cosim.signals import Constant, Impulse, Ramps, Signal, Sine, Steps
from ...scene import Member, Scene
from ...scene.body import RodParameters
from ...scene.manipulator import (
    AMBIENT,
    LOADS,
    ROD,
    TEMPERATURE,
    THERMAL,
    VOLTAGE,
    ThermalParameters,
    is_element_of,
)

__all__ = [
    "DimensionlessNumbers",
    "dimensionless_numbers",
    "is_unheated",
    "residual_envelope",
    "residual_vibration",
    "rise_time",
]

_INSTANT = 1e-9  # [s] length of the step at whose start a signal is evaluated
_CLAMPED_FREE = 1.8751040687119611  # first root of cos x cosh x = -1
# What several rods have in common: the number of the one that needs the finest model.
_WORST: dict[str, Callable[..., Any]] = {
    "shear": max,
    "extension": max,
    "gravity": max,
    "tip": max,
    "frequency": min,
    "damping": min,
    "parallel": all,
}


@dataclass(frozen=True)
class DimensionlessNumbers:
    """Numbers of one scene (formulas: module docstring); defaults where it lacks the FMU that they belong to."""

    biot: float = 0.0
    shear: float = 0.0
    extension: float = 0.0
    gravity: float = 0.0
    tip: float = 0.0
    ramp: float = math.inf  # time over which the fastest load grows [s]
    frequency: float = math.inf  # first, of the body alone [Hz]
    phase: float = math.inf  # of the first mode in one macro step [rad]
    damping: float = 0.0  # ratio of the first mode
    duration: float = 1.0  # of the scene [s]
    parallel: bool = True  # TCAs run parallel to the axis of a straight body
    loaded_by_others: bool = False  # other FMUs load the tip or set the gravity, by how much a run only can tell

    @property
    def residual(self) -> float:
        """Envelope of the vibration that the fastest load leaves behind, share of its deflection."""
        return residual_envelope(2.0 * math.pi * self.frequency, self.ramp)

    @property
    def vibration(self) -> float:
        """Rms over the scene of the vibration that the fastest load leaves behind, share of its deflection."""
        if math.isinf(self.frequency):
            return 0.0
        decay = 4.0 * math.pi * self.frequency * self.damping * self.duration
        return self.residual * math.sqrt(-math.expm1(-decay) / (2.0 * decay) if decay > 0.0 else 0.5)

    @property
    def load(self) -> float:
        """Sum of the gravity and the tip load number."""
        return self.gravity + self.tip

    @property
    def arc(self) -> bool:
        """Whether equilibria have constant strain exactly: only TCAs parallel to the rod act on it."""
        return self.parallel and self.load == 0.0 and not self.loaded_by_others


def residual_vibration(w: float, tau: float) -> float:
    """Amplitude of the undamped vibration of frequency w [rad/s] after a ramp of length tau [s].

    It is a share of the static deflection.
    """
    x = 0.5 * w * tau
    return abs(math.sin(x) / x) if x else 1.0


def residual_envelope(w: float, tau: float) -> float:
    """Least upper bound of residual_vibration() over all ramps of at least tau [s].

    A real ramp does not hit a zero of the sine exactly.
    """
    x = 0.5 * w * tau
    return min(1.0, 1.0 / x) if x else 1.0


def rise_time(signal: Signal) -> float:
    """Shortest time [s] in which a signal goes from one value to another: 0 at a jump, inf where it is constant."""
    match signal:
        case Constant():
            return math.inf
        case Steps(values=values):
            return 0.0 if len(set(values)) > 1 else math.inf
        case Ramps(times=times, values=values):
            pairs = zip(times, times[1:], values, values[1:], strict=False)
            return min((b - a for a, b, u, v in pairs if u != v), default=math.inf)
        case Sine(amplitude=amplitude, period=period):
            return 0.5 * period if amplitude else math.inf
        case Impulse(peak=peak, width=width):
            return width if peak else math.inf
    return 0.0


def is_unheated(scene: Scene) -> bool:
    """Whether temperatures stay constant exactly: no voltage at any time, everything at ambient temperature."""
    heats = scene.models(THERMAL)
    return bool(heats) and all(_stays_cold(scene, thermal) for thermal in heats)


def _stays_cold(scene: Scene, thermal: Member) -> bool:
    if VOLTAGE not in thermal.archive.vectors:  # another FMU of that name
        return False
    driven = [*thermal.archive.vectors[VOLTAGE], AMBIENT]
    if any(connection.target == (thermal.name, name) for connection in scene.connections for name in driven):
        return False
    *volts, ambient = (thermal.signals.get(name, Constant(thermal.real(name))).extremes for name in driven)
    return not any(value for extremes in volts for value in extremes) and set(ambient) == {thermal.real("T_0")}


def dimensionless_numbers(scene: Scene) -> DimensionlessNumbers:
    """Dimensionless numbers of the scene's thermal and rod FMUs, as far as it has them."""
    values: dict[str, Any] = {"duration": scene.stop_time}
    rods = scene.models(ROD)
    heats = [(m, ThermalParameters.of(m)) for m in scene.models(THERMAL)]
    if heats:
        values["biot"] = max(heat.transfer * heat.geometry.radius / heat.body_k for _, heat in heats)
    if rods:
        of_each = [_rod(rod) for rod in rods]
        values |= {key: _WORST[key](numbers[key] for numbers in of_each) for key in of_each[0]}
        fastest = max(numbers["frequency"] for numbers in of_each)
        values["phase"] = 2.0 * math.pi * fastest * scene.coupling.macro_step
        heating = [
            _heating_time(heat, s) for m, heat in heats for n, s in m.signals.items() if is_element_of(n, VOLTAGE)
        ]
        signals = [(rod, name, s) for rod in rods for name, s in rod.signals.items()]
        loads = [_loading_time(rod, s) for rod, n, s in signals if any(is_element_of(n, load) for load in LOADS)]
        temperatures = [rise_time(s) for _, n, s in signals if is_element_of(n, TEMPERATURE)]
        targets = [(c.target[0], c.target[1]) for c in scene.connections]
        names = [rod.name for rod in rods]
        values["loaded_by_others"] = any(m in names and any(is_element_of(n, f) for f in LOADS) for m, n in targets)
        values["ramp"] = min([*heating, *loads, *temperatures], default=math.inf)
    return DimensionlessNumbers(**values)


def _rod(rod: Member) -> dict[str, Any]:
    p = RodParameters.of(rod)
    length = p.length
    bending, shearing, stretching, line_mass = _section(p)
    gravity, force, moment = (_largest(rod, name) for name in LOADS)
    tip = p.tip_body.mass
    mass = line_mass + _CLAMPED_FREE**4 / 3.0 * tip / length  # Dunkerley: a mass at the tip slows the first mode
    arm = math.dist((0.0, 0.0, 0.0), p.tip_body.centre)
    frequency = _CLAMPED_FREE**2 * math.sqrt(bending / mass) / length**2 / (2.0 * math.pi)
    return {
        "shear": 12.0 * bending / (shearing * length**2),
        "extension": bending / (stretching * length**2),
        "gravity": line_mass * gravity * length**3 / bending,
        "tip": (force + tip * gravity) * length**2 / bending + (moment + tip * gravity * arm) * length / bending,
        "frequency": frequency,
        "damping": math.pi * frequency * max(segment.retardation for segment in p.segments),
        "parallel": _has_constant_strain(p),
    }


def _has_constant_strain(p: RodParameters) -> bool:
    """Whether heat alone bends the body to constant strain: a uniform body, TCAs parallel to its axis."""
    uniform = not any(segment != p.segments[0] for segment in p.segments)
    whole = all((tca.first_segment, tca.last_segment) == (1, len(p.segments)) for tca in p.tcas)
    straight = not any(segment.is_tapered or any(segment.curvature) for segment in p.segments)
    parallel = not any(tca.helix or tca.offset != tca.offset_end for tca in p.tcas)
    return uniform and whole and straight and parallel


def _section(p: RodParameters) -> tuple[float, float, float, float]:
    """Least stiffnesses in bending [N.m2], shear and stretch [N], largest mass per length [kg/m]."""
    sections = []
    for segment in p.segments:
        area, most = (math.pi * pick(segment.radius, segment.radius_end) ** 2 for pick in (min, max))
        if p.profile == "given":
            k = segment.stiffness
            stiffness = (min(k[:2]), min(k[3:5]), k[5])
        else:
            shearing = segment.shear_factor * segment.E / (2.0 * (1.0 + segment.nu)) * area
            stiffness = (segment.E * area**2 / (4.0 * math.pi), shearing, segment.E * area)
        sections.append((*stiffness, -segment.rho * most))
    bending, shearing, stretching, mass = (min(column) for column in zip(*sections, strict=True))
    return bending, shearing, stretching, -mass


def _heating_time(p: ThermalParameters, signal: Signal) -> float:
    """Rise time of the heat of one voltage [s], at least the diffusion time r^2/diffusivity of the TCA."""
    if not any(signal.extremes):
        return math.inf
    through = min(b**2 * c / k for b, c, k in zip(p.outer_radius, p.tca_rho_c, p.tca_k, strict=True))
    return through if signal.polynomial(0.0, _INSTANT)[0] else max(through, rise_time(signal))


def _loading_time(rod: Member, signal: Signal) -> float:
    """Rise time of a load [s]; 0 where it is there from the start and the rod starts straight."""
    start = signal.polynomial(0.0, _INSTANT)[0]
    return 0.0 if start and not rod.value("start_at_equilibrium") else rise_time(signal)


def _largest(rod: Member, vector: str) -> float:
    """Largest norm of a vector input, from the extremes of its elements."""
    signals: Iterable[Signal] = (rod.signals[n] for n in rod.archive.vectors[vector] if n in rod.signals)
    return math.sqrt(sum(max(abs(v) for v in s.extremes) ** 2 for s in signals))
