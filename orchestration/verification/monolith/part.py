"""A member of the monolith: differential equations (an FMU as model exchange) or an algebraic map (a quasi-static FMU,
whose outputs follow its inputs). Shapes: n states in use, n_u inputs, n_y wired outputs."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Protocol

import fmpy.fmi2 as fmi2
import numpy as np

from ...cosim.subsystem import Port
from ...errors import SubsystemError
from ...fmi.instance import Instance
from ...fmi.slave import Slave
from ...scene import Member

__all__ = ["Equilibrium", "Model", "Part"]


class Part(Protocol):
    name: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    nominals: np.ndarray  # (n,) of the states

    def follows(self, output: str) -> frozenset[str]:
        """The inputs that act on an output at once."""

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        """Outputs at the start for input values; repeatedly."""

    def begin(self) -> np.ndarray:
        """Ends initialisation; the states (n,) at the start."""

    def place(self, time: float, states: np.ndarray) -> None: ...

    def feed(self, values: np.ndarray) -> None: ...

    def values(self) -> np.ndarray:
        """Outputs (n_y,) now."""

    def rates(self) -> np.ndarray:
        """Time derivatives (n,) of the states now."""

    def record(self) -> np.ndarray: ...

    def close(self) -> None: ...


class Model(Instance):
    """An FMU for model exchange. Only states that its parameters need are shown."""

    kind = fmi2.FMU2Model

    def __init__(
        self, member: Member, inputs: Sequence[str], outputs: Sequence[str], recorded: Sequence[str] = ()
    ) -> None:
        description = member.archive.description
        if description.modelExchange is None:
            raise SubsystemError(f"{member.name}: {member.archive.path} offers no model exchange; export it with it")
        super().__init__(member.archive, member.name, member.parameters, inputs, outputs, recorded)
        rows = [unknown.variable for unknown in description.derivatives]
        self._rates = np.zeros(len(rows))
        self._all = np.zeros(len(rows))
        self._rates_buffer, self._all_buffer = (
            (fmi2.fmi2Real * len(rows)).from_buffer(values) for values in (self._rates, self._all)
        )
        self._pairs = [(row.derivative.valueReference, row.valueReference) for row in rows]
        self._direct = {
            unknown.variable.name: frozenset(
                inputs if unknown.dependencies is None else (v.name for v in unknown.dependencies)
            )
            for unknown in description.outputs
        }

    def follows(self, output: str) -> frozenset[str]:
        return self._direct[output]

    def begin(self) -> np.ndarray:
        self._call("fmi2ExitInitializationMode")
        self._call("fmi2EnterContinuousTimeMode")
        self._call("fmi2GetContinuousStates", self._all_buffer, self._all.size)
        start = self._all.copy()
        self._all += 1.0  # states that are not in use cannot be moved
        self._call("fmi2SetContinuousStates", self._all_buffer, self._all.size)
        self._call("fmi2GetContinuousStates", self._all_buffer, self._all.size)
        self._used = np.flatnonzero(self._all != start)
        self._call("fmi2GetNominalsOfContinuousStates", self._rates_buffer, self._rates.size)
        self.nominals = self._rates[self._used]
        self._all[:] = start
        self._call("fmi2SetContinuousStates", self._all_buffer, self._all.size)
        return start[self._used]

    def place(self, time: float, states: np.ndarray) -> None:
        self._all[self._used] = states
        self._call("fmi2SetTime", ctypes.c_double(time))
        self._call("fmi2SetContinuousStates", self._all_buffer, self._all.size)

    def feed(self, values: np.ndarray) -> None:
        self._write_inputs(values)

    def rates(self) -> np.ndarray:
        self._call("fmi2GetDerivatives", self._rates_buffer, self._rates.size)
        return self._rates[self._used]

    def linearised(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """A (n, n), B (n, n_u), C (n_y, n), D (n_y, n_u) here, by the FMU's directional derivatives."""
        n, outputs = self._used.size, len(self.outputs)
        unknowns = [*(self._pairs[k][1] for k in self._used), *self._wired.references]
        known = [*(self._pairs[k][0] for k in self._used), *self._driven.references]
        whole = np.zeros((n + outputs, len(known)))
        for k, reference in enumerate(known):
            whole[:, k] = self._fmu.getDirectionalDerivative(unknowns, [reference], [1.0])
        return whole[:n, :n], whole[:n, n:], whole[n:, :n], whole[n:, n:]


class Equilibrium:
    """A quasi-static FMU: each step of the co-simulation slave ends in the equilibrium of its inputs, whatever its
    length; it has no state of its own, and time means nothing to it."""

    nominals = np.zeros(0)

    def __init__(self, member: Member, inputs: Sequence[str], outputs: Sequence[str], recorded: Sequence[str]) -> None:
        self._slave = Slave(member.archive, member.name, member.parameters, inputs, outputs, recorded)
        self.name, self.inputs, self.outputs = member.name, self._slave.inputs, self._slave.outputs
        self._steps = 0
        self._inputs = np.zeros((4, len(self.inputs)))

    def follows(self, output: str) -> frozenset[str]:
        return frozenset(port.name for port in self.inputs)

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        return self._slave.initialise(time, values)

    def begin(self) -> np.ndarray:
        self._slave.begin()
        return np.zeros(0)

    def place(self, time: float, states: np.ndarray) -> None:
        pass

    def feed(self, values: np.ndarray) -> None:
        if self._steps and np.array_equal(self._inputs[0], values):
            return
        self._inputs[0] = values
        self._slave.set_inputs(self._inputs)
        self._slave.step(float(self._steps), 1.0)
        self._steps += 1

    def values(self) -> np.ndarray:
        return self._slave.values()

    def rates(self) -> np.ndarray:
        return np.zeros(0)

    def record(self) -> np.ndarray:
        return self._slave.record()

    def close(self) -> None:
        self._slave.close()
