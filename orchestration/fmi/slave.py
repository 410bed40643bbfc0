"""An FMI 2.0 co-simulation FMU as a subsystem (subsystem.py).

A sweep costs a handful of bare C calls. While the master iterates, fmi2DoStep is told that the state may be set back
(noSetFMUStatePriorToCurrentPoint = false)."""

from __future__ import annotations

import ctypes
import math

import fmpy.fmi2 as fmi2
import numpy as np
from fmpy.model_description import CoSimulation

from ..errors import SubsystemError
from .instance import Instance

__all__ = ["Slave"]


class Slave(Instance):
    """One instance for co-simulation."""

    kind = fmi2.FMU2Slave
    frozen = False
    _begun = False

    def _prepare(self, about: CoSimulation) -> None:
        self.can_rollback = about.canGetAndSetFMUstate
        self.takes_polynomials = about.canInterpolateInputs
        self.has_rates = about.maxOutputDerivativeOrder > 0
        self._has_tangent = about.providesDirectionalDerivative
        self._final = fmi2.fmi2Boolean(not self.can_rollback)  # whether no state is set back to before this step
        size = self._driven.size
        self._derivative_references = (fmi2.fmi2ValueReference * (3 * size))(*[*self._driven.references] * 3)
        self._orders = (fmi2.fmi2Integer * (3 * size))(*(order for order in (1, 2, 3) for _ in range(size)))
        self._derivative_counts = [ctypes.c_size_t(degree * size) for degree in range(4)]
        self._source: np.ndarray | None = None  # whose memory the next two are
        self._degree = 0  # the highest order of input derivatives sent so far; others the FMU need not know
        self._held: bytes | None = None  # the inputs sent last, where they are constant and the FMU still has them
        self._length = None if about.canHandleVariableCommunicationStepSize else 0.0  # [s] of all steps

    def begin(self) -> None:
        self._call("fmi2ExitInitializationMode")
        self._begun = True

    def close(self) -> None:
        if self._fmu is not None and self._begun and not self._dead:
            self.library.fmi2Terminate(self._component)  # whatever it answers, it is freed next
        self._begun = False
        super().close()

    def set_inputs(self, polynomials: np.ndarray) -> None:
        if not self._driven.size:
            return
        sent = polynomials.tobytes()
        if sent == self._held:
            return
        self._held = None
        if polynomials is not self._source:  # mostly the same array again, filled anew
            self._source = polynomials
            self._values = _doubles(polynomials[:1])
            self._derivatives = _doubles(polynomials[1:])
        self._set_values(self._values)
        rows = math.ceil(len(sent.rstrip(b"\0")) / len(sent) * 4)  # up to the last one with a bit that is set
        self._degree = max(self._degree, rows - 1)
        if self._degree and self.takes_polynomials:
            self._set_derivatives()
        if rows < 2:
            self._held = sent

    def restore(self, state: ctypes.c_void_p) -> None:
        self._held = None
        super().restore(state)

    def _set_derivatives(self) -> None:
        status = self.library.fmi2SetRealInputDerivatives(
            self._component,
            self._derivative_references,
            self._derivative_counts[self._degree],
            self._orders,
            self._derivatives,
        )
        if status != fmi2.fmi2OK:
            self._check(
                status,
                f"input derivatives up to order {self._degree} (coupling.exchange and coupling.waveform = 'held' send "
                "none, 'linear' the first)",
            )

    def step(self, time: float, length: float) -> None:
        if self._length is not None:
            self._length = self._length or length
            if abs(length - self._length) > 1e-9 * self._length:
                raise SubsystemError(
                    f"{self.name} takes steps of one length only (canHandleVariableCommunicationStepSize = false), "
                    f"{self._length:.6g} s so far, {length:.6g} s now; set coupling.control = 'fixed' and a "
                    "coupling.macro_step that divides the stop time and the times of all jumps"
                )
        status = self.library.fmi2DoStep(self._component, ctypes.c_double(time), ctypes.c_double(length), self._final)
        if status == fmi2.fmi2OK:
            return
        what = f"step from t = {time:.6g} s by {length:.3g} s"
        if status == fmi2.fmi2Discard:
            last = ctypes.c_double(time)
            self._call("fmi2GetRealStatus", fmi2.fmi2LastSuccessfulTime, ctypes.byref(last))
            raise SubsystemError(f"{self.name}: {what}: {self._log.take()}", last.value)
        self._check(status, what)

    def rates(self) -> np.ndarray:
        group = self._wired
        if group.size:
            status = self.library.fmi2GetRealOutputDerivatives(
                self._component, group.references, group.count, group.first_order, group.buffer
            )
            self._check(
                status, "output derivatives (without them exchange and waveform can be held, linear or quadratic)"
            )
        return group.values.copy()

    def tangent(self, columns: np.ndarray) -> np.ndarray | None:
        if not self._has_tangent:
            return None
        group, seed, one = self._wired, fmi2.fmi2Real(1.0), ctypes.c_size_t(1)
        found = np.empty((group.size, columns.size))
        for place, column in enumerate(columns):
            known = fmi2.fmi2ValueReference(self._driven.references[column])
            status = self.library.fmi2GetDirectionalDerivative(
                self._component,
                group.references,
                group.count,
                ctypes.byref(known),
                one,
                ctypes.byref(seed),
                group.buffer,
            )
            self._check(status, f"derivatives by {self.inputs[column].name}")
            found[:, place] = group.values
        return found


def _doubles(rows: np.ndarray) -> ctypes.Array[ctypes.c_double]:
    """The memory of an array in C order."""
    return (fmi2.fmi2Real * rows.size).from_buffer(rows)
