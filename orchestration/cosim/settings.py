"""Settings of the master, declared once: scenes are checked against them and the reference is written from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from .acceleration import METHODS as ACCELERATIONS
from .acceleration import Method, create
from .extrapolation import METHODS as EXTRAPOLATIONS
from .extrapolation import Extrapolation

__all__ = ["Coupling", "Declaration", "setting"]


@dataclass(frozen=True)
class Declaration:
    """What may be set.

    Attributes
    ----------
    meaning : str
        Noun phrase for help and reference.
    unit : str
        SI base unit of the number, "1" for none.
    least, most : float
        Allowed range.
    choices : tuple of str
        Allowed words; empty for numbers.
    """

    meaning: str
    unit: str
    least: float
    most: float
    choices: tuple[str, ...]


def setting(
    default: Any,
    meaning: str,
    unit: str = "1",
    least: float = 0.0,
    most: float = float("inf"),
    choices: Sequence[str] = (),
) -> Any:
    """Return a dataclass field with a Declaration; the default's type (float, int, str) is that of the setting."""
    return field(default=default, metadata={"declaration": Declaration(meaning, unit, least, most, tuple(choices))})


@dataclass(frozen=True)
class Coupling:
    """How the master couples. Tolerances are shares of the FMI nominals."""

    macro_step: float = setting(0.1, "length of a macro step, or its first length where `control` adapts it", "s", 1e-9)
    schedule: str = setting(
        "gauss_seidel", "order inside a loop: one after the other, or all at once", choices=("gauss_seidel", "jacobi")
    )
    method: str = setting("iqn", "how a loop is solved; none: explicit, one sweep", choices=("none", *ACCELERATIONS))
    omega: float = setting(0.25, "relaxation of the first sweeps, or of all where `method` is relaxed", "1", 1e-3, 2.0)
    exchange: str = setting(
        "hermite", "polynomials of inputs known at both ends of a step", choices=tuple(EXTRAPOLATIONS)
    )
    waveform: str = setting("linear", "polynomials of inputs that a loop iterates", choices=tuple(EXTRAPOLATIONS))
    tolerance: float = setting(1e-6, "bound of the estimated coupling error, share of the nominals", "1", 1e-14, 1.0)
    max_sweeps: int = setting(30, "maximum number of sweeps of a loop in a step", least=2, most=1000)
    halvings: int = setting(6, "maximum number of halvings of a failed step", least=0, most=30)
    reach: float = setting(10.0, "largest distance of a guess from the start of a step, in nominals", "1", 1e-3)
    control: str = setting("fixed", "control of the macro step's length", choices=("fixed", "doubling", "embedded"))
    step_tolerance: float = setting(1e-4, "error allowed per step where `control` adapts it", "1", 1e-13, 1.0)

    @cached_property
    def loop_method(self) -> Method | None:
        """Method that solves loops, None for explicit coupling with one sweep."""
        return None if self.method == "none" else create(self.method, self.omega)

    @cached_property
    def forward(self) -> Extrapolation:
        """Polynomials of inputs whose sources have done the step."""
        return EXTRAPOLATIONS[self.exchange]

    @cached_property
    def torn(self) -> Extrapolation:
        """Polynomials of inputs whose end values a loop guesses."""
        return EXTRAPOLATIONS[self.waveform]

    @property
    def trust_radius(self) -> float:
        """Largest distance of a guess from the start of a step, in nominals; further off, subsystems may fail."""
        return self.reach

    @property
    def least_step(self) -> float:
        """Length below which a failed step is not halved again [s]."""
        return self.macro_step * 0.5**self.halvings
