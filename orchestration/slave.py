"""An FMI 2.0 co-simulation FMU as a subsystem (subsystem.py).

A sweep costs a handful of bare C calls. While the master iterates, fmi2DoStep is told that the state may be set back
(noSetFMUStatePriorToCurrentPoint = false)."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence

import fmpy.fmi2 as fmi2
import numpy as np

from .archive import Archive
from .errors import SubsystemError
from .instance import Instance, Value

__all__ = ["Slave"]


class Slave(Instance):
    """One instance for co-simulation; arguments as Instance."""

    def __init__(
        self,
        archive: Archive,
        name: str,
        parameters: Mapping[str, Value],
        inputs: Sequence[str],
        outputs: Sequence[str],
        recorded: Sequence[str] = (),
        start: float = 0.0,
        stop: float | None = None,
    ) -> None:
        about = archive.description.coSimulation
        self.can_rollback = about.canGetAndSetFMUstate
        self.takes_polynomials = about.canInterpolateInputs
        self.has_rates = about.maxOutputDerivativeOrder > 0
        self._final = fmi2.fmi2False if self.can_rollback else fmi2.fmi2True  # no state is set back before this step
        super().__init__(fmi2.FMU2Slave, archive, name, parameters, inputs, outputs, recorded, start, stop)
        self._derivatives = np.zeros(3 * len(inputs))
        self._derivative_buffer = (fmi2.fmi2Real * self._derivatives.size).from_buffer(self._derivatives)
        self._derivative_references = (fmi2.fmi2ValueReference * self._derivatives.size)(
            *[*self._driven.references] * 3
        )
        self._orders = (fmi2.fmi2Integer * self._derivatives.size)(*(o for o in (1, 2, 3) for _ in inputs))

    def begin(self) -> None:
        self._call("fmi2ExitInitializationMode")

    def set_inputs(self, polynomials: np.ndarray) -> None:
        if not self._driven.size:
            return
        self._driven.values[:] = polynomials[0]
        self._set_values()
        if self.takes_polynomials:
            self._derivatives[:] = polynomials[1:].ravel()
            self._check(
                self.library.fmi2SetRealInputDerivatives(
                    self._component,
                    self._derivative_references,
                    self._derivatives.size,
                    self._orders,
                    self._derivative_buffer,
                ),
                "fmi2SetRealInputDerivatives",
            )

    def step(self, time: float, length: float) -> None:
        status = self.library.fmi2DoStep(self._component, time, length, self._final)
        if status <= fmi2.fmi2Warning:
            return
        reached = None
        if status == fmi2.fmi2Discard:
            last = ctypes.c_double(time)
            self._call("fmi2GetRealStatus", fmi2.fmi2LastSuccessfulTime, ctypes.byref(last))
            reached = last.value
        raise SubsystemError(f"{self.name}: step from t = {time:.6g} s by {length:.3g} s: {self._log.take()}", reached)

    def rates(self) -> np.ndarray:
        group = self._wired
        if group.size:
            status = self.library.fmi2GetRealOutputDerivatives(
                self._component, group.references, group.size, group.first_order, group.buffer
            )
            self._check(
                status, "output derivatives (without them exchange and waveform can be held, linear or quadratic)"
            )
        return group.values.copy()
