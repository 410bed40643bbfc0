"""An FMU for model exchange as a part of the monolith, with its state, time and step events."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence

import numpy as np

from ...errors import SubsystemError
from ...fmi import fmi2
from ...fmi.instance import Instance
from ...scene import Member
from .part import EventUpdate

__all__ = ["ModelExchangePart"]

_UPDATES = 1000  # of discrete states at one instant, after which an FMU is taken not to settle
_RELATIVE = 6e-6  # cube root of the rounding unit: step of central differences, share of a value's magnitude


class ModelExchangePart(Instance):
    """An FMU for model exchange. Only states that its parameters use are shown.

    Raises SubsystemError where the archive offers no model exchange or its description has no states to integrate.
    """

    kind = fmi2.MODEL_EXCHANGE

    def __init__(
        self, member: Member, inputs: Sequence[str], outputs: Sequence[str], recorded: Sequence[str] = ()
    ) -> None:
        description = member.archive.model_description()
        interface = description.modelExchange
        if interface is None:
            raise SubsystemError(f"{member.name}: {member.archive.path} offers no model exchange; export it with it")
        rows = [unknown.variable for unknown in description.derivatives]
        for row in rows:
            if row is None or row.derivative is None:
                raise SubsystemError(
                    f"{member.name}: {member.archive.path}: ModelStructure names the derivative "
                    f"{'of no variable' if row is None else row.name}, which says of no state that it is its "
                    "derivative; export the FMU again"
                )
        super().__init__(member.archive, member.name, member.parameters, inputs, outputs, recorded)
        self.indicator_count = int(description.numberOfEventIndicators or 0)
        self.next_event = math.inf
        self._tells_steps = not interface.completedIntegratorStepNotNeeded
        self._has_directional = bool(interface.providesDirectionalDerivative)
        self._rates = np.zeros(len(rows))
        self._all = np.zeros(len(rows))
        self._indicators = np.zeros(self.indicator_count)
        self._rates_buffer, self._all_buffer, self._indicators_buffer = (
            (fmi2.fmi2Real * values.size).from_buffer(values) if values.size else (fmi2.fmi2Real * 0)()
            for values in (self._rates, self._all, self._indicators)
        )
        self._pairs = [(row.derivative.valueReference, row.valueReference) for row in rows]
        self.state_names = [row.derivative.name for row in rows]
        self._direct = {
            unknown.variable.name: frozenset(
                inputs if unknown.dependencies is None else (v.name for v in unknown.dependencies)
            )
            for unknown in description.outputs
        }
        # A state depends on nothing at once, also where the description is silent.
        self._direct |= {name: frozenset() for name in self.state_names}

    def direct_inputs(self, output: str) -> frozenset[str]:
        """Names of the inputs that act on an output at once; all where the description does not say."""
        return self._direct.get(output, frozenset(port.name for port in self.inputs))

    def begin(self) -> np.ndarray:
        """End the initialisation and the first event; the states (n,) at the start."""
        self._call("fmi2ExitInitializationMode")
        for _ in range(_UPDATES):
            if not self.update_discrete().again:
                break
        else:
            raise SubsystemError(f"{self.name}: its discrete states do not settle at the start ({_UPDATES} updates)")
        self._call("fmi2EnterContinuousTimeMode")
        self._get_states()
        start = self._all.copy()
        self._used = np.arange(start.size)
        if start.size:
            self._all += 1.0  # states that are not in use cannot be moved
            self._call("fmi2SetContinuousStates", self._all_buffer, self._all.size)
            self._get_states()
            self._used = np.flatnonzero(self._all != start)
            self._call("fmi2GetNominalsOfContinuousStates", self._rates_buffer, self._rates.size)
            self.nominals = self._rates[self._used]
            self._all[:] = start
            self._call("fmi2SetContinuousStates", self._all_buffer, self._all.size)
        else:
            self.nominals = np.zeros(0)
        return start[self._used]

    def states_in_use(self) -> list[str]:
        """Names of the states that set_state() and rates() have, in their order."""
        return [self.state_names[k] for k in self._used]

    def set_state(self, time: float, states: np.ndarray) -> None:
        """Set time [s] and states (n,)."""
        self._all[self._used] = states
        self._call("fmi2SetTime", ctypes.c_double(time))
        if self._all.size:
            self._call("fmi2SetContinuousStates", self._all_buffer, self._all.size)

    def set_inputs(self, values: np.ndarray) -> None:
        """Set the inputs (n_u,)."""
        self._write_inputs(values)

    def rates(self) -> np.ndarray:
        """Time derivatives (n,) of the states now."""
        if self._rates.size:
            self._call("fmi2GetDerivatives", self._rates_buffer, self._rates.size)
        return self._rates[self._used]

    def indicators(self) -> np.ndarray:
        """Event indicators (n_z,) now."""
        if self.indicator_count:
            self._call("fmi2GetEventIndicators", self._indicators_buffer, self.indicator_count)
        return self._indicators.copy()

    def completed_step(self) -> tuple[bool, bool]:
        """Tell the end of an integrator step; whether the FMU needs an event, and whether it wishes to end."""
        if not self._tells_steps:
            return False, False
        event, terminate = fmi2.fmi2Boolean(), fmi2.fmi2Boolean()
        self._call("fmi2CompletedIntegratorStep", fmi2.fmi2True, ctypes.byref(event), ctypes.byref(terminate))
        return bool(event.value), bool(terminate.value)

    def enter_events(self) -> None:
        """Enter event mode."""
        self._call("fmi2EnterEventMode")

    def update_discrete(self) -> EventUpdate:
        """Update discrete states once, in event mode; notes the next time event."""
        info = fmi2.fmi2EventInfo()
        self._call("fmi2NewDiscreteStates", ctypes.byref(info))
        self.next_event = float(info.nextEventTime) if info.nextEventTimeDefined else math.inf
        return EventUpdate(bool(info.newDiscreteStatesNeeded), bool(info.terminateSimulation))

    def leave_events(self) -> np.ndarray:
        """Leave event mode; the states (n,), which an event may have changed."""
        self._call("fmi2EnterContinuousTimeMode")
        self._get_states()
        return self._all[self._used]

    def linearised(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Matrices A (n, n), B (n, n_u), C (n_y, n), D (n_y, n_u) at the present state and inputs.

        By the FMU's directional derivatives, or by central differences where it has none.
        """
        n, outputs = self._used.size, len(self.outputs)
        if not self._has_directional:
            return self._differences()
        unknowns = [*(self._pairs[k][1] for k in self._used), *self._wired.references]
        known = [*(self._pairs[k][0] for k in self._used), *self._driven.references]
        whole = np.zeros((n + outputs, len(known)))
        if unknowns:
            for k, reference in enumerate(known):
                whole[:, k] = self._directional(unknowns, reference)
        return whole[:n, :n], whole[:n, n:], whole[n:, :n], whole[n:, n:]

    def _directional(self, unknowns: list[int], known: int) -> np.ndarray:
        size = len(unknowns)
        column = (fmi2.fmi2Real * size)()
        self._call(
            "fmi2GetDirectionalDerivative",
            (fmi2.fmi2ValueReference * size)(*unknowns),
            size,
            (fmi2.fmi2ValueReference * 1)(known),
            1,
            (fmi2.fmi2Real * 1)(1.0),
            column,
        )
        return np.array(column)

    def _differences(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        states, inputs = self._all[self._used], self._driven.values.copy()
        n = states.size
        base = np.concatenate([states, inputs])
        nominal = np.concatenate([self.nominals, [port.nominal for port in self.inputs]])
        size = _RELATIVE * np.maximum(np.abs(base), np.abs(nominal))

        def evaluated(at: np.ndarray) -> np.ndarray:
            self._all[self._used] = at[:n]
            if n:
                self._call("fmi2SetContinuousStates", self._all_buffer, self._all.size)
            self.set_inputs(at[n:])
            return np.concatenate([self.rates(), self.values()])

        whole = np.zeros((n + len(self.outputs), base.size))
        for k in range(base.size):
            step = np.where(np.arange(base.size) == k, size, 0.0)
            whole[:, k] = (evaluated(base + step) - evaluated(base - step)) / (2.0 * size[k])
        evaluated(base)
        return whole[:n, :n], whole[:n, n:], whole[n:, :n], whole[n:, n:]

    def _get_states(self) -> None:
        if self._all.size:
            self._call("fmi2GetContinuousStates", self._all_buffer, self._all.size)
