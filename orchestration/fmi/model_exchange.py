"""Model-exchange FMUs of FMI 2.0 as subsystems of the master (cosim/subsystem.py).

Over a macro step CVODE integrates dx/dt = f(t, x, u) with the inputs u as polynomials in time. State events are located
as roots of the event indicators, time events are stopping times, and step events are asked for after every step of the
integrator. The integrator starts anew in each macro step, since inputs bend there, so that nothing of it is part of the
FMU's state.
"""

from __future__ import annotations

import ctypes
import math
from typing import Any, NamedTuple

import numpy as np

from ..errors import SubsystemError, TerminationRequest
from . import fmi2
from .description import Interface
from .instance import Instance
from .values import Group

__all__ = ["ModelExchangeInstance"]

RTOL = 1e-11  # of CVODE, and its absolute tolerance in nominals: below any tolerance of the coupling
MAX_INTERNAL_STEPS = 100_000  # of CVODE to the next event
TIME_RTOL = 1e-12  # share of a time within which a time event belongs to a step that ends there
MAX_EVENTS = 1_000  # in one macro step
MAX_EVENTS_AT_ONCE = 100  # without progress in time: the model switches forth and back
MAX_EVENT_ITERATIONS = 1_000  # calls of fmi2NewDiscreteStates at one event
RATE_STEP = 1e-5  # step of the difference quotients of outputs, share of the last macro step
FIRST_RATE_STEP = 1e-6  # [s] the same before the first macro step
ROOT_FOUND = 2  # status of CVODE at an event: CV_ROOT_RETURN


class _State(NamedTuple):
    """A saved state: time [s], continuous states (n,), inputs (4, n_u), next time event [s], events so far, handle."""

    time: float
    states: np.ndarray
    inputs: np.ndarray
    next_event: float
    events: int
    handle: ctypes.c_void_p | None


class ModelExchangeInstance(Instance):
    """One instance for model exchange with its integrator.

    States are set back by the FMU's own saved state where it has one (canGetAndSetFMUstate), else by its continuous
    states alone, which is refused across an event.
    """

    kind = fmi2.MODEL_EXCHANGE
    frozen = False
    can_rollback = True
    has_rates = True
    takes_polynomials = True
    _begun = False

    def _prepare(self, interface: Interface) -> None:
        description = self._archive.description
        self._saves_state = interface.can_save_state
        self._needs_completed_step = interface.needs_completed_step
        self._ended: TerminationRequest | None = None  # at the end of a step, which is whole
        self._continuous_columns = np.array([k for k, v in enumerate(self._driven_variables) if not v.discrete], int)
        self._discrete_columns = np.array([k for k, v in enumerate(self._driven_variables) if v.discrete], int)
        self._continuous = Group([self._driven_variables[k] for k in self._continuous_columns])
        self._discrete = Group([self._driven_variables[k] for k in self._discrete_columns])
        self._size, self._indicator_count = description.state_count, description.event_indicator_count
        self._states_array, self._states_buffer = _array(self._size)
        self._rates_array, self._rates_buffer = _array(self._size)
        self._indicators, self._indicators_buffer = _array(self._indicator_count)
        self._state_count, self._count = ctypes.c_size_t(self._size), ctypes.c_size_t(self._indicator_count)
        self._inputs = np.zeros((4, len(self.inputs)))
        self._origin = self._time = self._log.time  # where the input polynomials start, and where the FMU is [s]
        self._length = 0.0  # of the last step [s]
        self._next_event, self._events = math.inf, 0
        self._positive = np.zeros(self._indicator_count, dtype=bool)  # indicators when the FMU was last consistent

    def begin(self) -> None:
        """End initialization, handle the events of the start, and prepare the integrator."""
        try:
            from sksundae.cvode import CVODE
        except ImportError as error:
            raise SubsystemError(f"{self.name}: model exchange needs CVODE; pip install scikit-sundae") from error
        self._call("fmi2ExitInitializationMode")
        self._begun = True
        self._iterate_events()
        self._call("fmi2EnterContinuousTimeMode")
        nominals, buffer = _array(self._size)
        self._call("fmi2GetNominalsOfContinuousStates", buffer, self._size)
        self._read_states()
        self._positive = self._read_indicators() > 0.0
        if self._saves_state:
            try:
                super().free(super().save())
            except SubsystemError as error:
                self._require_alive()
                self._saves_state = False
                self._log.warn(f"canGetAndSetFMUstate = true, but states cannot be saved ({error}); run without")
        events: dict[str, Any] = {}
        if self._indicator_count:

            def event_function(time: float, states: np.ndarray, indicators: np.ndarray) -> None:
                self._move(time, states[: self._size])
                indicators[:] = self._read_indicators()

            events = {"eventsfn": event_function, "num_events": self._indicator_count}
        self._solver = CVODE(
            self._slope,
            method="BDF",
            rtol=RTOL,
            atol=RTOL * (np.abs(nominals) if self._size else np.ones(1)),
            max_num_steps=MAX_INTERNAL_STEPS,
            **events,
        )

    def close(self) -> None:
        """Release everything. May be called twice."""
        if self._loaded and self._begun and not self._dead:
            self.library.fmi2Terminate(self._component)  # whatever it answers, it is freed next
        self._begun = False
        super().close()

    def accepted_input_order(self, order: int) -> int:
        """Return the order: the integrator evaluates inputs at any time."""
        return order

    def set_inputs(self, polynomials: np.ndarray) -> None:
        """Set the inputs (4, n_u) for the next step, and their values now; discrete inputs take the first row alone."""
        changed = not np.array_equal(polynomials[0, self._discrete_columns], self._inputs[0, self._discrete_columns])
        self._inputs[:] = polynomials
        self._origin = self._time
        self._write_continuous(self._time)
        jumped = self._indicator_count and not np.array_equal(self._read_indicators() > 0.0, self._positive)
        if changed or jumped:
            self._handle_event()

    def step(self, time: float, length: float) -> None:
        """Advance from `time` by `length` [s].

        Raises SubsystemError, and TerminationRequest where the FMU ends the simulation within the step, or ended it
        where this one starts.
        """
        if self._ended is not None and self._ended.reached <= time + TIME_RTOL * max(abs(time), length):
            raise TerminationRequest(str(self._ended), time)
        self._origin = self._time = self._log.time = time
        self._length = length
        try:
            self._advance(time, length)
        except TerminationRequest as request:
            if request.reached < time + length * (1.0 - TIME_RTOL):
                raise
            self._ended = request  # the step is whole
        self._log.time = time + length
        self._steps += 1

    def _advance(self, time: float, length: float) -> None:
        """Integrate over a step, with the events in it."""
        end, at_once, first = time + length, 0, self._events
        last = end + TIME_RTOL * max(abs(end), length)
        while self._time < end or self._next_event <= last:
            before = self._time
            if self._integrate(self._next_event if self._next_event <= last else end) or self._time >= self._next_event:
                self._handle_event()
                at_once = at_once + 1 if self._time <= before else 0
                if self._events - first > MAX_EVENTS or at_once > MAX_EVENTS_AT_ONCE:
                    raise SubsystemError(
                        f"{self.name}: {self._events - first} events between t = {time:.6g} s and {self._time:.6g} s; "
                        "the model switches forth and back, give it a hysteresis"
                    )

    def rates(self) -> np.ndarray:
        """Return the time derivatives of the outputs now (n_y,), by differences of second order along the solution."""
        if not self._wired.size:
            return np.zeros(0)
        distance = RATE_STEP * self._length if self._length else FIRST_RATE_STEP
        if self._stop is not None and self._time + 2.0 * distance > self._stop:
            distance = -distance
        time, states = self._time, self._states_array.copy()
        slopes = self._evaluate_slopes(time, states).copy()
        values = []
        for k in (0.0, 1.0, 2.0):
            self._move(time + k * distance, states + k * distance * slopes)
            values.append(self.values())
        self._move(time, states)
        rates = (-3.0 * values[0] + 4.0 * values[1] - values[2]) / (2.0 * distance)
        held = [k for k, variable in enumerate(self._wired_variables) if variable.discrete]
        rates[held] = 0.0
        self._require_finite(rates, "time derivative of")
        return rates

    def tangent(self, columns: np.ndarray) -> None:
        """Return None: outputs follow the inputs' course over the step, not their values at an instant."""

    def save(self, into: Any = None) -> Any:
        """Return the present state; `into` is an older one whose handle may be overwritten."""
        handle = super().save(None if into is None else into.handle) if self._saves_state else None
        return _State(
            self._time, self._states_array.copy(), self._inputs.copy(), self._next_event, self._events, handle
        )

    def restore(self, state: Any) -> None:
        """Return to a saved state. Raises SubsystemError across an event where the FMU cannot save its state."""
        if state.handle is not None:
            super().restore(state.handle)
        elif state.events != self._events:
            raise SubsystemError(
                f"{self.name} cannot be set back across an event (canGetAndSetFMUstate = false); export with it, or "
                "ask for explicit coupling with coupling.method = 'none'"
            )
        self._next_event, self._events = state.next_event, state.events
        self._inputs[:] = state.inputs
        self._origin = state.time
        self._move(state.time, state.states)
        self._positive = self._read_indicators() > 0.0

    def free(self, state: Any) -> None:
        """Release a saved state, or the FMU's handle of one."""
        handle = state.handle if isinstance(state, _State) else state
        if handle is not None:
            super().free(handle)

    def _integrate(self, end: float) -> bool:
        """Integrate to `end` [s]; True where it stopped at a state event or step event."""
        if not self._size and not self._indicator_count:
            self._move(end, self._states_array)
            return self._needs_completed_step and self._completed_step()
        if end - self._time <= 4.0 * np.spacing(abs(end)):  # too short for CVODE
            self._move(end, self._states_array)
            return False
        self._solver.init_step(self._time, self._states_array.copy() if self._size else np.zeros(1))
        method = "onestep" if self._needs_completed_step else "normal"
        while self._time < end:
            solution = self._solver.step(end, method=method, tstop=end)
            if not solution.success:
                raise SubsystemError(f"{self.name}: CVODE at t = {self._time:.6g} s: {solution.message}", self._time)
            self._move(float(np.ravel(solution.t)[-1]), np.ravel(solution.y)[: self._size])
            if solution.status == ROOT_FOUND:
                return True
            if self._needs_completed_step and self._completed_step():
                return True
        return False

    def _completed_step(self) -> bool:
        """Tell the FMU that the integrator has done a step; True where it asks for an event."""
        enter, terminate = fmi2.fmi2Boolean(0), fmi2.fmi2Boolean(0)
        self._call("fmi2CompletedIntegratorStep", fmi2.fmi2False, ctypes.byref(enter), ctypes.byref(terminate))
        if terminate.value:
            self._end_simulation()
        return bool(enter.value)

    def _handle_event(self) -> None:
        """Let the FMU handle an event where it is, with the discrete inputs set."""
        self._call("fmi2EnterEventMode")
        if self._discrete.size:
            self._require(self._discrete.write(self.library, self._component, self._inputs[0, self._discrete_columns]))
        self._iterate_events()
        self._call("fmi2EnterContinuousTimeMode")
        self._read_states()
        self._positive = self._read_indicators() > 0.0

    def _iterate_events(self) -> None:
        """Iterate the discrete states until they stay; note the next time event."""
        self._events += 1
        info = fmi2.fmi2EventInfo()
        for _ in range(MAX_EVENT_ITERATIONS):
            self._call("fmi2NewDiscreteStates", ctypes.byref(info))
            if info.terminateSimulation:
                self._end_simulation()
            if not info.newDiscreteStatesNeeded:
                break
        else:
            raise SubsystemError(
                f"{self.name}: discrete states at t = {self._time:.6g} s still change after {MAX_EVENT_ITERATIONS} "
                "calls of fmi2NewDiscreteStates"
            )
        self._next_event = info.nextEventTime if info.nextEventTimeDefined else math.inf
        if self._next_event <= self._time:
            self._next_event = math.inf

    def _end_simulation(self) -> None:
        said = self._log.take()
        raise TerminationRequest(f"{self.name} ended the simulation at t = {self._time:.6g} s: {said}", self._time)

    def _move(self, time: float, states: np.ndarray) -> None:
        """Set time [s], continuous states (n,) and inputs."""
        self._time = time
        self._states_array[:] = states
        self._require(self.library.fmi2SetTime(self._component, ctypes.c_double(time)))
        if self._size:
            status = self.library.fmi2SetContinuousStates(self._component, self._states_buffer, self._state_count)
            self._require(status)
        self._write_continuous(time)

    def _write_continuous(self, time: float) -> None:
        if self._continuous.size:
            s, c = time - self._origin, self._inputs[:, self._continuous_columns]
            values = c[0] + s * (c[1] + s * (c[2] / 2.0 + s * c[3] / 6.0))
            self._require(self._continuous.write(self.library, self._component, values))

    def _evaluate_slopes(self, time: float, states: np.ndarray) -> np.ndarray:
        """Return dx/dt (n,) in a buffer that the next call overwrites."""
        self._move(time, states)
        if self._size:
            self._require(self.library.fmi2GetDerivatives(self._component, self._rates_buffer, self._state_count))
            if not np.isfinite(self._rates_array).all():
                raise SubsystemError(f"{self.name}: a derivative of a state at t = {time:.6g} s is not finite")
        return self._rates_array

    def _slope(self, time: float, states: np.ndarray, slopes: np.ndarray) -> None:
        if self._size:
            slopes[:] = self._evaluate_slopes(time, states)
        else:
            slopes[:] = 0.0  # CVODE wants a state

    def _read_indicators(self) -> np.ndarray:
        """Return the event indicators (m,) in a buffer that the next call overwrites."""
        if self._indicator_count:
            self._require(self.library.fmi2GetEventIndicators(self._component, self._indicators_buffer, self._count))
        return self._indicators

    def _read_states(self) -> None:
        if self._size:
            status = self.library.fmi2GetContinuousStates(self._component, self._states_buffer, self._state_count)
            self._require(status)

    def _require(self, status: int) -> None:
        if status != fmi2.fmi2OK:
            self._check(status, f"evaluation at t = {self._time:.6g} s")


def _array(size: int) -> tuple[np.ndarray, ctypes.Array[ctypes.c_double]]:
    """Return an array (size,) and its memory as C functions take it."""
    values = np.zeros(size)
    return values, (fmi2.fmi2Real * size).from_buffer(values)
