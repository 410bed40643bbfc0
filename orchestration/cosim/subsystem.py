"""The protocol of a subsystem: anything that maps polynomial inputs over a macro step to outputs at its end.

FMUs (slave.py) and analytic systems (linear.py) run under the same master through it. Shapes: n_u driven inputs, n_y
wired outputs. Inputs over [t, t+h] are polynomials u(t+s) = c0 + c1 s + c2 s^2/2 + c3 s^3/6, rows of an array (4,
n_u)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

__all__ = ["Port", "Recorder", "Subsystem"]


@dataclass(frozen=True)
class Port:
    """One scalar input or output."""

    name: str
    unit: str = "1"
    nominal: float = 1.0
    start: float = 0.0  # inputs: the value that holds where nothing drives it
    least: float = -np.inf
    most: float = np.inf


@runtime_checkable
class Subsystem(Protocol):
    """Life cycle: initialise (repeatedly, to settle loops at the start), begin, then steps, saves and restores,
    close."""

    name: str
    inputs: tuple[Port, ...]  # driven by the master, in this order
    outputs: tuple[Port, ...]  # read by the master, in this order
    has_rates: bool  # whether rates() is offered
    can_rollback: bool  # whether save() and restore() are offered
    takes_polynomials: bool  # whether more than the first row of set_inputs counts
    frozen: bool  # whether its outputs stay as they are at the start

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        """Outputs (n_y,) at the start time [s] for input values (n_u,)."""

    def begin(self) -> None:
        """Ends initialisation."""

    def set_inputs(self, polynomials: np.ndarray) -> None:
        """Sets the inputs (4, n_u), in C order, for the step to come."""

    def step(self, time: float, length: float) -> None:
        """Advances from time by length [s]. Raises SubsystemError, with the time reached where a smaller step may
        help."""

    def values(self) -> np.ndarray:
        """Outputs (n_y,) now, a fresh array."""

    def rates(self) -> np.ndarray:
        """Time derivatives (n_y,) of the outputs now, a fresh array."""

    def tangent(self, columns: np.ndarray) -> np.ndarray | None:
        """Derivatives (n_y, n) of the outputs now by the inputs of these columns (n,); None where not offered."""

    def save(self, into: Any = None) -> Any:
        """A handle of the present state; `into` is an older handle to be written over."""

    def restore(self, state: Any) -> None:
        """Back to a saved state; the handle stays valid."""

    def free(self, state: Any) -> None:
        """Releases a handle."""

    def close(self) -> None:
        """Releases everything. May be called twice."""


class Recorder(Subsystem, Protocol):
    """A subsystem whose variables are written to the result."""

    def record(self) -> np.ndarray:
        """Recorded variables now, (n,)."""
