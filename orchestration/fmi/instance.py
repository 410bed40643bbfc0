"""One instance of an FMI 2.0 FMU through fmpy's bindings: what both of its interfaces need. Value references, buffers
and function pointers are prepared once; a call that fails raises SubsystemError with what the FMU logged."""

from __future__ import annotations

import ctypes
import itertools
import weakref
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import fmpy.fmi2 as fmi2
import numpy as np
from fmpy.fmi1 import FMICallException, printLogMessage
from fmpy.logging import addLoggerProxy
from fmpy.model_description import CoSimulation, ModelExchange

from ..cosim.subsystem import Port
from ..errors import SubsystemError
from .archive import Archive, Variable

__all__ = ["Group", "Instance", "Value"]

Value = float | int | bool | str
_CHATTER = ("logEvents", "logSingularLinearSystems", "logNonlinearSystems", "logDynamicStateSelection")  # FMI's names


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


class Group:
    """Real variables that are read or written together."""

    def __init__(self, variables: Sequence[Variable]) -> None:
        self.size = len(variables)
        self.references = (fmi2.fmi2ValueReference * self.size)(*(v.reference for v in variables))
        self.count = ctypes.c_size_t(self.size)
        self.values = np.zeros(self.size)
        self.buffer = (fmi2.fmi2Real * self.size).from_buffer(self.values)
        self.first_order = (fmi2.fmi2Integer * self.size)(*[1] * self.size)


class Instance:
    """parameters: name -> value in the variable's own unit, set before initialisation; inputs, outputs: names of the
    variables that are driven and read; recorded: names of those that record() reads."""

    kind: ClassVar[type[fmi2.FMU2Slave] | type[fmi2.FMU2Model]]

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
        description = archive.description
        about = description.coSimulation if self.kind is fmi2.FMU2Slave else description.modelExchange
        variables = archive.variables
        self.name = name
        self.inputs = tuple(_port(variables[v]) for v in inputs)
        self.outputs = tuple(_port(variables[v]) for v in outputs)
        self._start, self._stop = start, stop
        self._driven = Group([variables[v] for v in inputs])
        self._wired = Group([variables[v] for v in outputs])
        self._recorded = Group([variables[v] for v in recorded])
        self._log = _Log()
        self._states: set[int | None] = set()
        self._overwrites = True  # whether fmi2GetFMUstate writes over the handle it is given
        self._dead = ""  # why, after fmi2Fatal: nothing may be called any more
        self._initialising = False
        try:
            self._fmu = self.kind(
                guid=archive.guid,
                unzipDirectory=str(archive.extract()),
                modelIdentifier=about.modelIdentifier,
                instanceName=name,
            )
        except Exception as error:  # a binary for this platform is missing, or a library that it needs
            raise SubsystemError(f"{name}: {archive.path} cannot be loaded here: {error}") from error
        self.library: Any = _untyped(self._fmu.dll)
        self._prepare(about)
        try:
            self._instantiate([category.name for category in description.logCategories])
            self._set_parameters(variables, parameters)
        except BaseException:
            self.close()
            raise

    def _prepare(self, about: CoSimulation | ModelExchange) -> None:
        """What an interface needs besides, from what the description says of it."""

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        if not self._initialising:
            self._call("fmi2SetupExperiment", 0, 0.0, self._start, int(self._stop is not None), self._stop or 0.0)
            self._call("fmi2EnterInitializationMode")
            self._initialising = True
        self._driven.values[:] = values
        self._set_values(self._driven.buffer)
        return self.values()

    def values(self) -> np.ndarray:
        return self._read(self._wired)

    def record(self) -> np.ndarray:
        """The recorded variables now, a fresh array."""
        return self._read(self._recorded)

    def save(self, into: ctypes.c_void_p | None = None) -> ctypes.c_void_p:
        state = ctypes.c_void_p() if into is None else into
        if state.value is not None and not self._overwrites:
            self.free(state)
            state.value = None
        old = state.value
        self._live()
        self._check(self.library.fmi2GetFMUstate(self._component, ctypes.byref(state)), "fmi2GetFMUstate")
        if state.value != old:
            self._states.add(state.value)
            if old is not None:
                # The old one may have moved or been left behind. Freeing it now could be once too often; from here on
                # the handle is freed before.
                self._states.discard(old)
                self._overwrites = False
        return state

    def restore(self, state: ctypes.c_void_p) -> None:
        self._live()
        self._check(self.library.fmi2SetFMUstate(self._component, state), "fmi2SetFMUstate")

    def free(self, state: ctypes.c_void_p) -> None:
        if self._fmu is not None and state.value in self._states:
            self._states.discard(state.value)
            if self._dead:
                return
            self.library.fmi2FreeFMUstate(self._component, ctypes.byref(state))

    def close(self) -> None:
        if self._fmu is None:
            return
        for state in tuple(self._states):
            self.free(ctypes.c_void_p(state))
        # PythonFMU's binaries are never unloaded, and at exit they count down in memory they have just freed, which
        # can abort the process, unless they let go of it before. Instances that live on hold it themselves.
        let_go = getattr(self._fmu.dll, "finalizePythonInterpreter", None)
        if let_go is not None:
            let_go()
        if self._fmu.component is not None and not self._dead:
            self._fmu.freeInstance()
        self._fmu = None

    def watch_calls(self, wrap: Callable[[Any], Any]) -> None:
        """Replace the table of C functions by wrap(table), which may count or time the calls."""
        self.library = wrap(self.library)

    def messages(self) -> list[str]:
        """Warnings that no exception has carried yet."""
        return list(dict.fromkeys(self._log.messages))

    def _instantiate(self, categories: Sequence[str]) -> None:
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = _receive
        callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
        callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
        callbacks.componentEnvironment = self._log.key
        addLoggerProxy(ctypes.byref(callbacks))
        try:
            self._fmu.instantiate(callbacks=callbacks, loggingOn=True)  # without it some keep errors to themselves
        except Exception as error:
            raise SubsystemError(f"{self.name}: {error}: {self._log.take()}") from error
        self._component = ctypes.c_void_p(self._fmu.component)
        chatter = [name.encode() for name in categories if name in _CHATTER]
        if chatter:
            self._call("fmi2SetDebugLogging", fmi2.fmi2False, len(chatter), (fmi2.fmi2String * len(chatter))(*chatter))

    def _set_parameters(self, variables: Mapping[str, Variable], parameters: Mapping[str, Value]) -> None:
        setters = {"Real": self._fmu.setReal, "Boolean": self._fmu.setBoolean, "String": self._fmu.setString}
        for kind in ("Real", "Integer", "Boolean", "Enumeration", "String"):
            names = [name for name in parameters if variables[name].type == kind]
            if not names:
                continue
            try:
                setters.get(kind, self._fmu.setInteger)(
                    [variables[n].reference for n in names], [parameters[n] for n in names]
                )
            except FMICallException as error:
                raise SubsystemError(f"{self.name}: setting {', '.join(names)}: {self._log.take()}") from error

    def _set_values(self, values: ctypes.Array[ctypes.c_double]) -> None:
        group = self._driven
        if group.size:
            status = self.library.fmi2SetReal(self._component, group.references, group.count, values)
            if status != fmi2.fmi2OK:
                self._check(status, "setting inputs")

    def _read(self, group: Group) -> np.ndarray:
        if group.size:
            status = self.library.fmi2GetReal(self._component, group.references, group.count, group.buffer)
            if status != fmi2.fmi2OK:
                self._check(status, "reading outputs")
        return group.values.copy()

    def _live(self) -> None:
        if self._dead:
            raise SubsystemError(self._dead, fatal=True)

    def _call(self, function: str, *arguments: object) -> None:
        self._check(getattr(self._fmu.dll, function)(self._component, *arguments), function)

    def _check(self, status: int, what: str) -> None:
        if status <= fmi2.fmi2Warning:
            return
        text = f"{self.name}: {what}: {self._log.take()}"
        if status == fmi2.fmi2Fatal:
            self._dead = text = f"{text}; a fatal error, after which it cannot go on"
        raise SubsystemError(text, fatal=status == fmi2.fmi2Fatal)


def _untyped(library: ctypes.CDLL) -> ctypes.CDLL:
    """The C functions again, without the argument types that fmpy gives them, whose conversions take longer than most
    calls: every argument is a value or an array of ctypes."""
    return ctypes.CDLL(library._name, handle=library._handle)


def _port(v: Variable) -> Port:
    start = 0.0 if v.start is None else float(v.start)
    return Port(v.name, v.unit, v.nominal, start, v.least, v.most)
