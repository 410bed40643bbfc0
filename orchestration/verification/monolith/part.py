"""A member of the monolith: differential equations, or an algebraic map.

The first is an FMU as model exchange, the second a quasi-static FMU, whose outputs follow its inputs. Shapes: n states
in use, n_u inputs, n_y wired outputs, n_z event indicators.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from ...cosim.subsystem import Port
from ...fmi.slave import Slave
from ...fmi.values import Group
from ...fmi.variables import Variable
from ...scene import Member

__all__ = ["EventUpdate", "Part", "QuasiStaticPart"]


class EventUpdate(NamedTuple):
    """What one update of discrete states tells."""

    again: bool  # whether a further update is needed at the same instant
    terminate: bool  # whether the FMU wishes the simulation to end


class Part(Protocol):
    """One member. Life cycle: initialise (repeatedly), begin, then any order of the rest, close."""

    name: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    nominals: np.ndarray  # (n,) of the states
    indicator_count: int  # n_z
    next_event: float  # time of the next time event [s]; inf: none

    def direct_inputs(self, output: str) -> frozenset[str]:
        """Names of the inputs that act on an output at once."""

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        """Outputs (n_y,) at the start time [s] for input values (n_u,)."""

    def begin(self) -> np.ndarray:
        """End the initialisation; the states (n,) at the start."""

    def set_state(self, time: float, states: np.ndarray) -> None:
        """Set time [s] and states (n,)."""

    def set_inputs(self, values: np.ndarray) -> None:
        """Set the inputs (n_u,)."""

    def values(self) -> np.ndarray:
        """Outputs (n_y,) now."""

    def rates(self) -> np.ndarray:
        """Time derivatives (n,) of the states now."""

    def indicators(self) -> np.ndarray:
        """Event indicators (n_z,) now."""

    def completed_step(self) -> tuple[bool, bool]:
        """Tell the end of an integrator step; whether the part needs an event, and whether it wishes to end."""

    def enter_events(self) -> None:
        """Enter event mode."""

    def update_discrete(self) -> EventUpdate:
        """Update discrete states once, in event mode."""

    def leave_events(self) -> np.ndarray:
        """Leave event mode; the states (n,), which an event may have changed."""

    def record(self) -> np.ndarray:
        """Recorded variables now."""

    def close(self) -> None:
        """Release everything."""


class _ReadableSlave(Slave):
    """A slave whose local variables can be read."""

    def read(self, variables: Sequence[Variable]) -> np.ndarray:
        """Values (n,) of Real variables now."""
        return self._read(Group(variables))


# Outputs of a quasi-static rod that tell how fast its inputs change, which a map of inputs to outputs cannot know.
RATE_OUTPUTS = ("tip.v", "energy.kinetic", "energy.dissipated")


class QuasiStaticPart:
    """A quasi-static FMU.

    Each step of the co-simulation slave ends in the equilibrium of its inputs, whatever its length. It has no states;
    time does not matter to it. RATE_OUTPUTS are recorded as nan: not known.
    """

    nominals = np.zeros(0)
    indicator_count = 0
    next_event = math.inf

    def __init__(self, member: Member, inputs: Sequence[str], outputs: Sequence[str], recorded: Sequence[str]) -> None:
        self._slave = _ReadableSlave(member.archive, member.name, member.parameters, inputs, outputs, recorded)
        self.name, self.inputs, self.outputs = member.name, self._slave.inputs, self._slave.outputs
        self._variables = member.archive.variables
        self._unknown = [k for k, name in enumerate(recorded) if name.partition("[")[0] in RATE_OUTPUTS]
        self._steps = 0
        self._inputs = np.zeros((4, len(self.inputs)))

    def direct_inputs(self, output: str) -> frozenset[str]:
        """All inputs: they act at once."""
        return frozenset(port.name for port in self.inputs)

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        """Outputs (n_y,) at the start time [s] for input values (n_u,)."""
        return self._slave.initialise(time, values)

    def begin(self) -> np.ndarray:
        """End the initialisation; there are no states."""
        self._slave.begin()
        return np.zeros(0)

    def set_state(self, time: float, states: np.ndarray) -> None:
        """Nothing to set."""

    def set_inputs(self, values: np.ndarray) -> None:
        """Go to the equilibrium of the inputs (n_u,), unless it is there already."""
        if self._steps and np.array_equal(self._inputs[0], values):
            return
        self._inputs[0] = values
        self._slave.set_inputs(self._inputs)
        self._slave.step(float(self._steps), 1.0)
        self._steps += 1

    def values(self) -> np.ndarray:
        """Outputs (n_y,) at the equilibrium."""
        return self._slave.values()

    def rates(self) -> np.ndarray:
        """Empty: there are no states."""
        return np.zeros(0)

    def indicators(self) -> np.ndarray:
        """Empty: an equilibrium has no events."""
        return np.zeros(0)

    def completed_step(self) -> tuple[bool, bool]:
        """Nothing to tell."""
        return False, False

    def enter_events(self) -> None:
        """Nothing to do."""

    def update_discrete(self) -> EventUpdate:
        """There are no discrete states."""
        return EventUpdate(False, False)

    def leave_events(self) -> np.ndarray:
        """There are no states."""
        return np.zeros(0)

    def read(self, names: Sequence[str]) -> dict[str, float]:
        """Values at the equilibrium of those of the variables that the FMU has and that are not rates."""
        variables = self._variables
        known = [name for name in names if name in variables and not name.startswith("strain_rate")]
        return dict(zip(known, self._slave.read([variables[name] for name in known]).tolist(), strict=True))

    def record(self) -> np.ndarray:
        """Recorded variables at the equilibrium; nan for RATE_OUTPUTS."""
        values = self._slave.record()
        values[self._unknown] = np.nan
        return values

    def close(self) -> None:
        """Release the FMU."""
        self._slave.close()
