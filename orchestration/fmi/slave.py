"""Co-simulation FMUs of FMI 2.0 as subsystems of the master (cosim/subsystem.py).

A sweep costs a handful of bare C calls.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import SubsystemError, TerminationRequest
from . import block_interface, fmi2
from .description import Interface
from .instance import Instance, Value
from .log import Log

__all__ = ["Slave"]

TIME_RTOL = 1e-9  # share of a step below which two times are the same
MAX_DEGREE = 3  # of the input polynomials: rows of Slave.set_inputs less one


class Slave(Instance):
    """One instance for co-simulation."""

    kind = fmi2.CO_SIMULATION
    frozen = False
    _begun = False

    def _prepare(self, interface: Interface) -> None:
        # Derivatives go to and come from continuous Reals; all others are held.
        self._driven_columns = np.array([k for k, v in enumerate(self._driven_variables) if not v.discrete], dtype=int)
        self._rate_columns = np.array([k for k, v in enumerate(self._wired_variables) if not v.discrete], dtype=int)
        references = [self._driven_variables[k].reference for k in self._driven_columns]
        size = len(references)
        self._all_continuous = size == self._driven.size
        # The polynomials of the continuous inputs, row by row: values, then derivatives.
        self._polynomials = np.zeros((MAX_DEGREE + 1, size))
        self._value_buffer = (fmi2.fmi2Real * size).from_buffer(self._polynomials)
        self._derivative_buffer = (fmi2.fmi2Real * (MAX_DEGREE * size)).from_buffer(self._polynomials, 8 * size)
        self._derivative_references = (fmi2.fmi2ValueReference * (MAX_DEGREE * size))(*references * MAX_DEGREE)
        self._derivative_orders = (fmi2.fmi2Integer * (MAX_DEGREE * size))(
            *(order for order in range(1, MAX_DEGREE + 1) for _ in range(size))
        )
        self._derivative_counts = [ctypes.c_size_t(degree * size) for degree in range(MAX_DEGREE + 1)]
        self._row_bytes = 8 * self._driven.size
        self._zero_row = bytes(self._row_bytes)
        rated = self._rate_columns.size
        self._rates = np.zeros(rated)
        self._rate_buffer = (fmi2.fmi2Real * rated).from_buffer(self._rates)
        self._rate_references = (fmi2.fmi2ValueReference * rated)(
            *(self._wired_variables[k].reference for k in self._rate_columns)
        )
        self._rate_orders = (fmi2.fmi2Integer * rated)(*[1] * rated)
        self._rate_count = ctypes.c_size_t(rated)
        self._prepare_run(interface)

    def _prepare_run(self, interface: Interface) -> None:
        """Prepare what a run changes."""
        self.can_rollback = interface.can_save_state
        self.takes_polynomials = interface.can_interpolate_inputs
        self.has_rates = interface.max_output_derivative_order > 0
        self._polynomials[:] = 0.0
        self._accepted = MAX_DEGREE  # highest order of input derivatives that the FMU takes
        self._degree = 0  # the highest order of input derivatives sent so far; others the FMU need not know
        self._held: bytes | None = None  # the inputs sent last, where they are constant and the FMU still has them
        self._ended: dict[int, str] = {}  # number of steps after which the FMU ended the simulation -> what it said
        self._length = None if interface.takes_variable_steps else 0.0  # [s] of all steps

    def begin(self) -> None:
        """End initialisation, and find out whether states can be saved as the description says."""
        self._call("fmi2ExitInitializationMode")
        self._begun = True
        if self.can_rollback:
            try:
                self.free(self.save())
            except SubsystemError as error:
                self._require_alive()
                self.can_rollback = False
                self._log.warn(f"canGetAndSetFMUstate = true, but states cannot be saved ({error}); run without")

    def accepted_input_order(self, order: int) -> int:
        """Return the highest order, at most `order`, of input derivatives that the FMU takes.

        The XML tells only whether it takes some (canInterpolateInputs), so the FMU is asked with derivatives of zero.
        """
        if not self.takes_polynomials or not self._driven_columns.size:
            return order if self.takes_polynomials else 0
        before = self.save() if self.can_rollback else None
        self._polynomials[1:] = 0.0
        for accepted in range(order, 0, -1):
            status = self.library.fmi2SetRealInputDerivatives(
                self._component,
                self._derivative_references,
                self._derivative_counts[accepted],
                self._derivative_orders,
                self._derivative_buffer,
            )
            if status <= fmi2.fmi2Warning:
                break
            if status == fmi2.fmi2Fatal:
                self._check(status, f"input derivatives of order {accepted}")
            self._log.take()
            if before is not None:
                self.restore(before)
        else:
            accepted, self.takes_polynomials = 0, False
        if before is not None:
            self.free(before)
        self._accepted = accepted
        return accepted

    @property
    def accepted_order(self) -> int:
        """Highest order of input derivatives that accepted_input_order() found."""
        return self._accepted if self.takes_polynomials else 0

    def close(self) -> None:
        """Release everything. May be called twice."""
        if self._loaded and self._begun and not self._dead:
            self.library.fmi2Terminate(self._component)  # whatever it answers, it is freed next
        self._begun = False
        super().close()

    @property
    def reusable(self) -> bool:
        """Whether reset() makes it what a new instance is: FMUs of this project are tested to do so."""
        return self._archive.reentrant and self._loaded and self._begun and not self._dead

    @property
    def runs_in_blocks(self) -> bool:
        """Whether macro steps may be taken in C++ (block_steps.py): all variables are continuous and Real."""
        simple = self._all_continuous and self._rate_columns.size == self._wired.size and self._recorded.real_only
        return self.reusable and simple and self.can_rollback and self._length is None

    def is_ready_for_blocks(self) -> bool:
        """Return whether nothing besides the master holds a state, watches calls or ended the simulation."""
        return len(self._states) <= 1 and self._overwrites and not self._ended and type(self.library) is ctypes.CDLL

    @cached_property
    def block_functions(self) -> dict[str, ctypes.c_void_p]:
        """Addresses of the C functions that a loop in C++ calls, by the field of block_interface.Node."""
        return {
            field: ctypes.cast(getattr(self._untyped, f"fmi2{function}"), ctypes.c_void_p)
            for field, function in block_interface.FUNCTIONS.items()
        }

    def block_references(self) -> tuple[Any, Any, Any]:
        """Return the value references of inputs, outputs and recorded variables, as C arrays."""
        return self._driven.references, self._wired.references, self._recorded.references

    def lend(self, structure: block_interface.Node, sent: np.ndarray) -> None:
        """Write which inputs (4, n_u) the FMU has."""
        structure.has_sent = self._held is not None
        if self._held is not None:
            sent[:] = np.frombuffer(self._held).reshape(sent.shape)
        structure.degree, structure.accepted_degree = self._degree, self._accepted

    def take_back(
        self,
        structure: block_interface.Node,
        sent: np.ndarray,
        handle: ctypes.c_void_p,
        done: int,
        end: float,
        failed: bool,
    ) -> None:
        """Continue after `done` steps, the last to `end` [s], that were taken in C++; `handle` holds the last start."""
        self._held = sent.tobytes() if structure.has_sent else None
        self._degree = structure.degree
        self._steps += done
        self._states = {handle.value: self._steps if failed or not done else self._steps - 1}
        self._oldest = min(self._states.values())
        if done:
            self._log.time = end

    @property
    def log(self) -> Log:
        """Messages of the FMU."""
        return self._log

    def rest(self) -> None:
        """Stop to receive messages, until reset() begins another run."""
        self._log.resting = True

    def reset(
        self,
        parameters: Mapping[str, Value],
        start: float = 0.0,
        stop: float | None = None,
        tolerance: float | None = None,
    ) -> None:
        """Return to what a new instance with these parameters is; arguments are those of Instance.

        Raises
        ------
        SubsystemError
            The FMU refuses it or a value.
        """
        for state in tuple(self._states):
            self.free(ctypes.c_void_p(state))
        self._typed.fmi2Terminate(self._component)
        self._begun = self._initialising = False
        self._stop, self._steps = stop, 0
        self._log.restart(start)
        self._overwrites = True
        self.library = self._untyped
        self._prepare_run(self._archive.description.interface)
        self._call("fmi2Reset")
        self._set_up(parameters, start, stop, tolerance)

    def set_inputs(self, polynomials: np.ndarray) -> None:
        """Set the inputs for the step to come.

        Rows (4, n_u) of c0 + c1 s + c2 s^2/2 + c3 s^3/6 over the time s since its start; discrete inputs take c0
        alone.
        """
        if not self._driven.size:
            return
        sent = polynomials.tobytes()
        if sent == self._held:
            return
        self._held = None
        if self._all_continuous:
            self._polynomials[:] = polynomials
            status = self.library.fmi2SetReal(
                self._component, self._driven.references, self._driven.count, self._value_buffer
            )
            if status != fmi2.fmi2OK:
                self._check(status, "setting inputs")
        else:
            self._polynomials[:] = polynomials[:, self._driven_columns]
            self._write_inputs(polynomials[0])
        degree, row = self._accepted, self._row_bytes
        while degree and sent[degree * row : (degree + 1) * row] == self._zero_row:
            degree -= 1
        self._degree = max(self._degree, degree)
        if self._degree and self.takes_polynomials and self._driven_columns.size:
            self._set_derivatives()
        if not degree:
            self._held = sent

    def restore(self, state: ctypes.c_void_p) -> None:
        """Go back to a saved state; the handle stays valid."""
        self._held = None
        super().restore(state)

    def _set_derivatives(self) -> None:
        status = self.library.fmi2SetRealInputDerivatives(
            self._component,
            self._derivative_references,
            self._derivative_counts[self._degree],
            self._derivative_orders,
            self._derivative_buffer,
        )
        if status != fmi2.fmi2OK:
            self._check(
                status,
                f"input derivatives up to order {self._degree} (coupling.exchange and coupling.waveform = 'held' send "
                "none, 'linear' the first)",
            )

    def step(self, time: float, length: float) -> None:
        """Advance from time by length [s].

        The FMU gets noSetFMUStatePriorToCurrentPoint = true exactly when no state is alive that was saved before
        this step's start.

        Raises
        ------
        TerminationRequest
            The FMU ends the simulation.
        SubsystemError
            The step failed; with the time reached where a smaller one may help.
        """
        if self._length is not None:
            self._require_length(length)
        self._log.time = time
        if self._ended and self._steps in self._ended:
            raise TerminationRequest(self._ended[self._steps], time)
        status = self.library.fmi2DoStep(
            self._component, ctypes.c_double(time), ctypes.c_double(length), int(self._oldest >= self._steps)
        )
        if status <= fmi2.fmi2Warning:
            self._steps += 1
            if status:
                self._check(status, "fmi2DoStep")
            self._log.messages.clear()  # they explain no later failure
            self._log.time = time + length
            return
        what = f"step from t = {time:.6g} s by {length:.3g} s"
        if status == fmi2.fmi2Discard:
            self._discarded(time, length, what)
        else:
            self._check(status, what)

    def _require_length(self, length: float) -> None:
        """Refuse a step of another length, where the FMU takes one length only."""
        self._length = self._length or length
        if abs(length - self._length) > 1e-9 * self._length:
            raise SubsystemError(
                f"{self.name} takes steps of one length only (canHandleVariableCommunicationStepSize = false), "
                f"{self._length:.6g} s so far, {length:.6g} s now; set coupling.control = 'fixed' and a "
                "coupling.macro_step that divides the stop time and the times of all jumps"
            )

    def _discarded(self, time: float, length: float, what: str) -> None:
        """Raise the error of a step that came only part of the way, or of an FMU that ends the simulation.

        Where it ends at the end of the step, the step is valid, and the next one raises.
        """
        said = self._log.take()
        last, ended = ctypes.c_double(time), ctypes.c_int(fmi2.fmi2False)
        if self.library.fmi2GetRealStatus(self._component, fmi2.fmi2LastSuccessfulTime, ctypes.byref(last)):
            last.value = time  # not every FMU tells
        # PythonFMU answers fmi2Terminated = true to every step that its model refuses.
        if not self._of_pythonfmu and self.library.fmi2GetBooleanStatus(
            self._component, fmi2.fmi2Terminated, ctypes.byref(ended)
        ):
            ended.value = fmi2.fmi2False
        reached = min(max(last.value, time), time + length) if math.isfinite(last.value) else time
        self._log.messages.clear()
        if ended.value:
            text = f"{self.name} ended the simulation at t = {reached:.6g} s: {said}"
            if reached < time + length * (1.0 - TIME_RTOL):
                raise TerminationRequest(text, reached)
            self._steps += 1
            self._ended = {self._steps: text}
            self._log.time = time + length
            return
        raise SubsystemError(f"{self.name}: {what}: {said}", reached)

    def rates(self) -> np.ndarray:
        """Return the time derivatives of the outputs now, a fresh array (n_y,); 0 for those that are held."""
        if self._rate_columns.size:
            status = self.library.fmi2GetRealOutputDerivatives(
                self._component, self._rate_references, self._rate_count, self._rate_orders, self._rate_buffer
            )
            if status != fmi2.fmi2OK:
                self._check(
                    status, "output derivatives (without them exchange and waveform can be held, linear or quadratic)"
                )
        if self._rate_columns.size == self._wired.size:
            rates = self._rates.copy()
        else:
            rates = np.zeros(self._wired.size)
            rates[self._rate_columns] = self._rates
        if not math.isfinite(sum(rates.tolist())):
            self._require_finite(rates, "time derivative of")
        return rates

    def tangent(self, columns: np.ndarray) -> np.ndarray | None:
        """Return the derivatives (n_y, n) of the outputs now by the inputs of these columns (n,).

        None where the FMU offers none; 0 for those that are held.
        """
        if not self.has_tangent:
            return None
        seed, one = fmi2.fmi2Real(1.0), ctypes.c_size_t(1)
        tangent = np.zeros((self._wired.size, columns.size))
        for k, column in enumerate(columns):
            variable = self._driven_variables[column]
            if variable.discrete or not self._rate_columns.size:
                continue
            known = fmi2.fmi2ValueReference(variable.reference)
            status = self.library.fmi2GetDirectionalDerivative(
                self._component,
                self._rate_references,
                self._rate_count,
                ctypes.byref(known),
                one,
                ctypes.byref(seed),
                self._rate_buffer,
            )
            self._check(status, f"derivatives by {variable.name}")
            tangent[self._rate_columns, k] = self._rates
            self._require_finite(tangent[:, k], f"derivative by {variable.name} of")
        return tangent
