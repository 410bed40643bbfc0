"""Names of the variables and parameters of thermal.fmu and rod.fmu: all that the package knows of its two own FMUs.

Everything else handles FMUs of any origin. Whoever needs a physical quantity of the manipulator reads it from
ThermalParameters here or from RodParameters in body.py, or takes a name from the constants below.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

__all__ = [
    "AMBIENT",
    "CLOSURE_EXCHANGED",
    "CLOSURE_INSIDE",
    "DEFAULT_FMUS",
    "DEFAULT_WIRING",
    "DISPLACEMENT",
    "DISPLACEMENT_GUESS",
    "ELEMENTS_SET",
    "LOADS",
    "ROD",
    "SETS",
    "SHAPE_OUTPUTS",
    "SHARED_PARAMETERS",
    "SSP_OUTPUTS",
    "STIFFNESS",
    "TEMPERATURE",
    "THERMAL",
    "THERMAL_OUTPUTS",
    "VOLTAGE",
    "Geometry",
    "Parameters",
    "RecordedParameters",
    "ThermalParameters",
    "is_element_of",
    "set_by",
]

THERMAL, ROD = "thermal", "rod"  # model names of the FMUs, and names of the members of a scene that says nothing else
DEFAULT_FMUS = {THERMAL: "thermal.fmu", ROD: "rod.fmu"}

# Outputs and inputs.
VOLTAGE, AMBIENT = "V", "T_ambient"
TEMPERATURE = "T"  # output of the thermal FMU, input of the rod
DISPLACEMENT, DISPLACEMENT_GUESS = "delta", "delta_guess"  # output of the rod; its input where the master closes it
LOADS = ("gravity", "tip_force", "tip_moment")  # vector inputs of the rod
STIFFNESS = "body.stiffness"  # vector parameter of the rod for given profiles
SHAPE_OUTPUTS = ("shape.p", "tip.quaternion")  # of the rod: enough to draw it
THERMAL_OUTPUTS = ("T", "T_surface")
SSP_OUTPUTS = ("thermal.T", "rod.tip.p", "rod.tip.euler")  # connectors of an exported system beside those wired

# Items of the rod's parameter closure.
CLOSURE_INSIDE, CLOSURE_EXCHANGED = 1, 2

# Parameters of the rod that set others when they are set: those of every segment, or of one TCA at the end of its span.
# The value goes to all elements of the vectors; that of body.length is divided among them.
SETS: Mapping[str, tuple[str, ...]] = {
    "body.radius": ("segment.radius",),
    "body.length": ("segment.length",),
    **{f"body.{key}": (f"segment.{key}",) for key in ("E", "nu", "rho", "shear_factor", "retardation")},
    "strains": ("segment.strains",),
    "order": ("segment.order",),
    "tca.offset": ("tca.offset_end",),
}
# The same for elements of vectors: each sets those whose last index is its own.
ELEMENTS_SET: Mapping[str, str] = {
    "body.stiffness": "segment.stiffness",
    "body.curvature": "segment.curvature",
    "tca.offset": "tca.offset_end",
}

# Parameters of both FMUs that must agree.
SHARED_PARAMETERS = ("body.radius", "body.length", "tca.offset", "tca.azimuth")


class Parameters(Protocol):
    """Values of the parameters of an FMU by name; scene.Member is one."""

    def real(self, parameter: str) -> float:
        """Value of a scalar."""

    def reals(self, vector: str) -> tuple[float, ...]:
        """Values of a vector's elements in the order of their indices."""

    def each(self, parameter: str, count: int) -> tuple[float, ...]:
        """Values of a parameter for `count` TCAs: those of a vector, or those of a scalar that holds for all."""

    def choice(self, parameter: str) -> str:
        """Name of an enumeration's item."""

    def has(self, parameter: str) -> bool:
        """Whether the FMU has a parameter: its size and options decide."""


@dataclass(frozen=True)
class RecordedParameters:
    """Parameters as a result records them: element names, such as tca.azimuth[1], to values."""

    values: Mapping[str, float]
    choices: Mapping[str, str]

    def real(self, parameter: str) -> float:
        """Return the value of a scalar parameter."""
        return self.values[parameter]

    def reals(self, vector: str) -> tuple[float, ...]:
        """Return the values of the elements of a vector."""
        return tuple(value for name, value in self.values.items() if is_element_of(name, vector))

    def each(self, parameter: str, count: int) -> tuple[float, ...]:
        """Return one value for each of `count` TCAs or segments."""
        return self.reals(parameter) or (self.real(parameter),) * count

    def choice(self, parameter: str) -> str:
        """Return the item of an enumeration parameter."""
        return self.choices[parameter]

    def has(self, parameter: str) -> bool:
        """Tell whether the result records a parameter."""
        return parameter in self.values


def is_element_of(name: str, vector: str) -> bool:
    """Tell whether a variable is an element of a vector: V[1] of V."""
    return re.fullmatch(rf"{re.escape(vector)}\[[\d,]+\]", name) is not None


def set_by(parameter: str, vectors: Mapping[str, Sequence[str]]) -> tuple[tuple[str, ...], float]:
    """Return the parameters of a rod that setting `parameter` sets too, and the share of the value that each gets.

    vectors: elements of each vector of the FMU.
    """
    base, bracket, index = parameter.partition("[")
    if bracket:
        elements = vectors.get(ELEMENTS_SET.get(base, ""), ())
        return tuple(name for name in elements if re.split(r"[\[,]", name)[-1] == index), 1.0
    elements = tuple(name for vector in SETS.get(parameter, ()) for name in vectors.get(vector, ()))
    return elements, 1.0 / len(elements) if parameter == "body.length" and elements else 1.0


@dataclass(frozen=True)
class Geometry:
    """Cross-section and length of the body, and where the TCAs run in it; both FMUs have these parameters."""

    radius: float  # [m]
    length: float  # [m]
    offset: tuple[float, ...]  # distance of each TCA from the axis [m]
    azimuth: tuple[float, ...]  # of each TCA [rad]

    @classmethod
    def of(cls, p: Parameters) -> Geometry:
        """Read the parameters of a thermal or rod FMU."""
        azimuth = p.reals("tca.azimuth")
        return cls(p.real("body.radius"), p.real("body.length"), p.each("tca.offset", len(azimuth)), azimuth)


@dataclass(frozen=True)
class ThermalParameters:
    """Parameters of thermal.fmu in SI units; tuples have one value for each TCA."""

    geometry: Geometry
    outer_radius: tuple[float, ...]  # [m]
    inner_radius: tuple[float, ...]  # of the bore [m]
    body_k: float  # conductivity [W/(m.K)]
    body_rho_c: float  # heat capacity per volume [J/(m3.K)]
    tca_k: tuple[float, ...]
    tca_rho_c: tuple[float, ...]
    transfer: float  # heat transfer coefficient of the surface [W/(m2.K)]
    resistance: tuple[float, ...]  # at T_ref [ohm]
    alpha: tuple[float, ...]  # temperature coefficient of the resistance [1/K]
    beta: tuple[float, ...]  # displacement coefficient of the resistance [1]
    T_ref: float  # [K]
    T_0: float  # [K]

    @classmethod
    def of(cls, p: Parameters) -> ThermalParameters:
        """Read the parameters of a thermal FMU."""
        geometry = Geometry.of(p)
        count = len(geometry.azimuth)
        return cls(
            geometry=geometry,
            outer_radius=p.each("tca.outer_radius", count),
            inner_radius=p.each("tca.inner_radius", count),
            body_k=p.real("body.k"),
            body_rho_c=p.real("body.rho_c"),
            tca_k=p.each("tca.k", count),
            tca_rho_c=p.each("tca.rho_c", count),
            transfer=p.real("h"),
            resistance=p.each("tca.R", count),
            alpha=p.each("tca.alpha_T", count),
            beta=p.each("tca.beta", count),
            T_ref=p.real("tca.T_ref"),
            T_0=p.real("T_0"),
        )


class Settings(Protocol):
    """What decides whether a default connection acts; scene.Member is one."""

    def acts(self, parameter: str) -> bool:
        """Whether a parameter, or an element of a vector, is there and not 0."""

    def value(self, parameter: str) -> float | int | bool | str | None:
        """Value of a parameter, None where there is no such parameter."""


# Source, target, and when: by default equal quantities are wired; what the master must iterate only where it acts.
DEFAULT_WIRING: Sequence[tuple[tuple[str, str], tuple[str, str], Callable[[Mapping[str, Settings]], bool]]] = (
    ((THERMAL, TEMPERATURE), (ROD, TEMPERATURE), lambda members: True),
    (
        (ROD, DISPLACEMENT),
        (ROD, DISPLACEMENT_GUESS),
        lambda members: members[ROD].value("closure") == CLOSURE_EXCHANGED,
    ),
    ((ROD, DISPLACEMENT), (THERMAL, DISPLACEMENT), lambda members: members[THERMAL].acts("tca.beta")),
)
