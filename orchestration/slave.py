"""An FMI 2.0 co-simulation FMU as a subsystem (subsystem.py), through fmpy's bindings.

Value references, buffers and function pointers are prepared once: a sweep costs a handful of bare C calls. While the
master iterates, fmi2DoStep is told that the state may be set back (noSetFMUStatePriorToCurrentPoint = false)."""

from __future__ import annotations

import ctypes
import itertools
import weakref
from collections.abc import Mapping, Sequence
from typing import ClassVar

import fmpy.fmi2 as fmi2
import numpy as np
from fmpy.fmi1 import FMICallException, printLogMessage
from fmpy.logging import addLoggerProxy

from .archive import Archive, Variable
from .errors import SubsystemError
from .subsystem import Port

__all__ = ["Slave"]

Value = float | int | bool


class _Log:
    """What one instance logged since the last look."""

    _open: ClassVar[weakref.WeakValueDictionary[int, _Log]] = weakref.WeakValueDictionary()
    _keys = itertools.count(1)

    def __init__(self) -> None:
        self.messages: list[str] = []
        self.key = next(self._keys)
        self._open[self.key] = self

    @classmethod
    def receive(cls, environment: int | None, instance: bytes, status: int, category: bytes, message: bytes) -> None:
        # fmpy's proxy keeps one receiver per process, so messages of instances that are not ours come here as well.
        log = cls._open.get(environment or 0)
        if log is None:
            printLogMessage(environment, instance, status, category, message)
        elif status != fmi2.fmi2OK:
            log.messages.append(message.decode("utf-8", "replace").replace("##", "#"))

    def take(self) -> str:
        text = "; ".join(dict.fromkeys(self.messages)) or "nothing was logged"
        self.messages.clear()
        return text


_receive = fmi2.fmi2CallbackLoggerTYPE(_Log.receive)


class _Group:
    """Real variables that are read or written together."""

    def __init__(self, variables: Sequence[Variable]) -> None:
        self.size = len(variables)
        self.references = (fmi2.fmi2ValueReference * self.size)(*(v.reference for v in variables))
        self.values = np.zeros(self.size)
        self.buffer = (fmi2.fmi2Real * self.size).from_buffer(self.values)
        self.first_order = (fmi2.fmi2Integer * self.size)(*[1] * self.size)


class Slave:
    """One instance.

    parameters: name -> value in the variable's own unit, set before initialisation; inputs, outputs: names of the
    variables that the master drives and reads; recorded: names of the outputs that record() reads. Raises
    SubsystemError with the FMU's log."""

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
        self.name = name
        self.can_rollback = about.canGetAndSetFMUstate
        self.takes_polynomials = about.canInterpolateInputs
        self.has_rates = about.maxOutputDerivativeOrder > 0
        variables = archive.variables
        self.inputs = tuple(_port(variables[v]) for v in inputs)
        self.outputs = tuple(_port(variables[v]) for v in outputs)
        self._start, self._stop = start, stop
        self._driven = _Group([variables[v] for v in inputs])
        self._wired = _Group([variables[v] for v in outputs])
        self._recorded = _Group([variables[v] for v in recorded])
        self._derivatives = np.zeros(3 * len(inputs))
        self._derivative_buffer = (fmi2.fmi2Real * self._derivatives.size).from_buffer(self._derivatives)
        self._derivative_references = (fmi2.fmi2ValueReference * self._derivatives.size)(
            *[*self._driven.references] * 3
        )
        self._orders = (fmi2.fmi2Integer * self._derivatives.size)(*(o for o in (1, 2, 3) for _ in inputs))
        self._final = fmi2.fmi2False if self.can_rollback else fmi2.fmi2True  # no state is set back before this step
        self._log = _Log()
        self._states: set[int] = set()
        self._initialising = False
        self._fmu: fmi2.FMU2Slave | None = fmi2.FMU2Slave(
            guid=archive.guid,
            unzipDirectory=str(archive.extract()),
            modelIdentifier=about.modelIdentifier,
            instanceName=name,
        )
        self.library = self._fmu.dll  # the C functions; a proxy in its place may watch the calls
        try:
            self._instantiate()
            self._set_parameters(variables, parameters)
        except BaseException:
            self.close()
            raise

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        if not self._initialising:
            self._call("fmi2SetupExperiment", 0, 0.0, self._start, int(self._stop is not None), self._stop or 0.0)
            self._call("fmi2EnterInitializationMode")
            self._initialising = True
        self._driven.values[:] = values
        self._set_values()
        return self.values()

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

    def values(self) -> np.ndarray:
        return self._read(self._wired)

    def record(self) -> np.ndarray:
        """The recorded outputs now, a fresh array."""
        return self._read(self._recorded)

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

    def save(self, into: ctypes.c_void_p | None = None) -> ctypes.c_void_p:
        state = ctypes.c_void_p() if into is None else into
        self._check(self.library.fmi2GetFMUstate(self._component, ctypes.byref(state)), "fmi2GetFMUstate")
        self._states.add(state.value)
        return state

    def restore(self, state: ctypes.c_void_p) -> None:
        self._check(self.library.fmi2SetFMUstate(self._component, state), "fmi2SetFMUstate")

    def free(self, state: ctypes.c_void_p) -> None:
        if self._fmu is not None and state.value in self._states:
            self._states.discard(state.value)
            self.library.fmi2FreeFMUstate(self._component, ctypes.byref(state))

    def close(self) -> None:
        if self._fmu is None:
            return
        for state in tuple(self._states):
            self.free(ctypes.c_void_p(state))
        if self._fmu.component is not None:
            self._fmu.freeInstance()
        self._fmu = None

    def messages(self) -> list[str]:
        """Warnings that no exception has carried yet."""
        return list(dict.fromkeys(self._log.messages))

    def _instantiate(self) -> None:
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = _receive
        callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
        callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
        callbacks.componentEnvironment = self._log.key
        addLoggerProxy(ctypes.byref(callbacks))
        try:
            self._fmu.instantiate(callbacks=callbacks)
        except Exception as error:
            raise SubsystemError(f"{self.name}: {error}: {self._log.take()}") from error
        self._component = self._fmu.component

    def _set_parameters(self, variables: Mapping[str, Variable], parameters: Mapping[str, Value]) -> None:
        setters = {"Real": self._fmu.setReal, "Boolean": self._fmu.setBoolean}
        for kind in ("Real", "Integer", "Boolean", "Enumeration"):
            names = [name for name in parameters if variables[name].type == kind]
            if not names:
                continue
            try:
                setters.get(kind, self._fmu.setInteger)(
                    [variables[n].reference for n in names], [parameters[n] for n in names]
                )
            except FMICallException as error:
                raise SubsystemError(f"{self.name}: setting {', '.join(names)}: {self._log.take()}") from error

    def _set_values(self) -> None:
        group = self._driven
        if group.size:
            status = self.library.fmi2SetReal(self._component, group.references, group.size, group.buffer)
            self._check(status, "setting inputs")

    def _read(self, group: _Group) -> np.ndarray:
        if group.size:
            self._check(
                self.library.fmi2GetReal(self._component, group.references, group.size, group.buffer), "reading outputs"
            )
        return group.values.copy()

    def _call(self, function: str, *arguments: object) -> None:
        self._check(getattr(self.library, function)(self._component, *arguments), function)

    def _check(self, status: int, what: str) -> None:
        if status > fmi2.fmi2Warning:
            raise SubsystemError(f"{self.name}: {what}: {self._log.take()}")


def _port(v: Variable) -> Port:
    start = 0.0 if v.start is None else float(v.start)
    return Port(v.name, v.unit, v.nominal, start, v.least, v.most)
