"""The protocol of a subsystem: a map from polynomial inputs over a macro step to outputs at its end.

FMUs (fmi.slave) and analytic systems (linear_subsystem) run under the same master through it. Shapes: n_u driven
inputs, n_y wired outputs. Inputs over [t, t+h] are polynomials u(t+s) = c0 + c1 s + c2 s^2/2 + c3 s^3/6, the rows of
an array (4, n_u).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

__all__ = ["Port", "Recorder", "Subsystem"]


@dataclass(frozen=True)
class Port:
    """A scalar input or output.

    Attributes
    ----------
    name, unit : str
        As the subsystem calls them.
    nominal : float
        Typical size, the unit of tolerances.
    start : float
        Value of an input that nothing drives.
    least, most : float
        Allowed range.
    discrete : bool
        Whether the value changes at communication points only: it is held over a step, never interpolated, and an
        iteration does not solve for it.
    has_nominal : bool
        Whether the nominal is declared. Where it is not, loops weigh errors by the size of the values seen.
    """

    name: str
    unit: str = "1"
    nominal: float = 1.0
    start: float = 0.0
    least: float = -np.inf
    most: float = np.inf
    discrete: bool = False
    has_nominal: bool = True


@runtime_checkable
class Subsystem(Protocol):
    """What the master steps.

    Life cycle: initialise() repeatedly, to solve loops at the start; begin(); steps, saves and restores; close().

    Attributes
    ----------
    name : str
        Unique among the coupled subsystems.
    inputs, outputs : tuple of Port
        Driven and read by the master, in this order.
    has_rates : bool
        Whether rates() is offered.
    can_rollback : bool
        Whether save() and restore() are offered.
    takes_polynomials : bool
        Whether more than the first row of set_inputs() counts.
    frozen : bool
        Whether the outputs stay as they are at the start.
    """

    name: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    has_rates: bool
    can_rollback: bool
    takes_polynomials: bool
    frozen: bool

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        """Return the outputs (n_y,) at the start time [s] for input values (n_u,)."""

    def begin(self) -> None:
        """End initialization."""

    def accepted_input_order(self, order: int) -> int:
        """Return the highest order, at most `order`, of input derivatives that it takes; after begin()."""

    def set_inputs(self, polynomials: np.ndarray) -> None:
        """Set the inputs (4, n_u), in C order, for the next step."""

    def step(self, time: float, length: float) -> None:
        """Advance from `time` by `length` [s].

        Raises SubsystemError, with the time reached where a smaller step may help.
        """

    def values(self) -> np.ndarray:
        """Return the outputs (n_y,) now, a new array."""

    def rates(self) -> np.ndarray:
        """Return the time derivatives (n_y,) of the outputs now, a new array."""

    def tangent(self, columns: np.ndarray) -> np.ndarray | None:
        """Return the derivatives (n_y, n) of the outputs by the inputs of these columns (n,); None if not offered."""

    def save(self, into: Any = None) -> Any:
        """Return a handle of the present state; `into` is an older handle that may be overwritten."""

    def restore(self, state: Any) -> None:
        """Return to a saved state; the handle stays valid."""

    def free(self, state: Any) -> None:
        """Release a handle."""

    def close(self) -> None:
        """Release everything. May be called twice."""


class Recorder(Subsystem, Protocol):
    """A subsystem whose variables are written to the result."""

    def record(self) -> np.ndarray:
        """Return the recorded variables (n,) now."""
