"""One instance of an FMI 2.0 FMU: what both of its interfaces need.

A call that fails raises SubsystemError with what the FMU logged; warnings are counted (log.py).
"""

from __future__ import annotations

import contextlib
import ctypes
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..cosim.subsystem import Port
from ..errors import SubsystemError
from . import fmi2
from .archive import Archive, library_path
from .description import Interface
from .log import RECEIVER, Log, Warned
from .values import Group, number_of
from .variables import TYPES, Value, Variable

__all__ = ["Instance", "Value"]

NO_STATE = 2**63  # more steps than any instance takes
_CHATTER = ("logEvents", "logSingularLinearSystems", "logNonlinearSystems", "logDynamicStateSelection")  # FMI's names


class Instance:
    """An instance of an FMU, loaded and with its parameters set.

    Parameters
    ----------
    archive
        The FMU.
    name
        Name of the instance.
    parameters
        Name -> value in the variable's own unit, set before initialisation.
    inputs, outputs
        Names of the variables that are driven and read.
    recorded
        Names of the variables that record() reads.
    start, stop
        Start and stop time of the experiment [s].
    tolerance
        Relative tolerance of the experiment; None: the FMU's own.

    Raises
    ------
    SubsystemError
        The FMU cannot be loaded or refuses a value.
    """

    kind: ClassVar[int]  # fmi2.CO_SIMULATION or MODEL_EXCHANGE

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
        tolerance: float | None = None,
    ) -> None:
        description, variables = archive.description, archive.variables
        interface = description.co_simulation if self.kind == fmi2.CO_SIMULATION else description.model_exchange
        assert interface is not None, "whoever makes an instance asks for an interface that the FMU has"
        self.name = name
        self._archive, self._stop = archive, stop
        self.inputs = tuple(_port(name, variables[v]) for v in inputs)
        self.outputs = tuple(_port(name, variables[v]) for v in outputs)
        self._driven_variables = [variables[v] for v in inputs]
        self._wired_variables = [variables[v] for v in outputs]
        self._driven = Group(self._driven_variables)
        self._wired = Group(self._wired_variables)
        self._recorded = Group([variables[v] for v in recorded])
        self._log = Log(name)
        self._log.time = start
        self._steps = 0  # accepted since the start, less those taken back
        self._states: dict[int | None, int] = {}  # live state -> number of steps at which it was saved
        self._oldest = NO_STATE  # the least of these numbers
        self._overwrites = True  # whether fmi2GetFMUstate writes over the handle it is given
        self._dead = ""  # why, after fmi2Fatal: nothing may be called any more
        self._initialising = False
        self._component: Any = None
        self._parameters: dict[str, Value] = {}  # those that _settings holds, ready to be set
        self._settings: list[tuple[Group, np.ndarray, list[str]]] = []
        self._folder, self._typed = self._load(archive, interface)
        self._loaded = True
        self._untyped = fmi2.untyped(self._typed)
        self.library: Any = self._untyped
        self.has_tangent = interface.has_directional_derivatives
        self._prepare(interface)
        try:
            self._instantiate(archive.guid, description.log_categories)
            self._set_up(parameters, start, stop, tolerance)
        except BaseException:
            self.close()
            raise

    def _set_up(
        self, parameters: Mapping[str, Value], start: float, stop: float | None, tolerance: float | None
    ) -> None:
        """Set experiment and parameters of an instance that is new, or reset."""
        self._call(
            "fmi2SetupExperiment",
            int(tolerance is not None),
            tolerance or 0.0,
            start,
            int(stop is not None),
            stop or 0.0,
        )
        self._set_parameters(self._archive.variables, parameters)

    def _load(self, archive: Archive, interface: Interface) -> tuple[Path, ctypes.CDLL]:
        """Load the shared library of an interface; return the folder of the FMU and the library."""
        identifier = interface.model_identifier
        if not identifier or any(character in identifier for character in "/\\:\0"):
            raise SubsystemError(
                f"{self.name}: {archive.path}: modelIdentifier = {identifier!r} names no library; export the FMU again"
            )
        folder = archive.extract_for_instance(identifier)
        if not library_path(folder, identifier).is_file():
            there = sorted(path.name for path in (folder / "binaries").glob("*") if any(path.iterdir()))
            raise SubsystemError(
                f"{self.name}: {archive.path} cannot be loaded here: it has no binaries/{fmi2.PLATFORM}/{identifier}"
                f"{fmi2.LIBRARY_ENDING}, but binaries for {', '.join(there) or 'no platform'}; export it for "
                f"{fmi2.PLATFORM}"
            )
        try:
            return folder, fmi2.load_library(library_path(folder, identifier), self.kind)
        except (OSError, AttributeError) as error:
            raise SubsystemError(f"{self.name}: {archive.path} cannot be loaded here: {error}") from error

    def _prepare(self, interface: Interface) -> None:
        """Prepare what an interface needs besides, from what the description says of it."""

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        """Set the inputs (n_u,) at the start; return the outputs (n_y,). May be called again until begin()."""
        if not self._initialising:
            # As most hosts do: there are FMUs that read their inputs at the begin of initialisation alone.
            self._write_inputs(values)
            self._call("fmi2EnterInitializationMode")
            self._initialising = True
        self._write_inputs(values)
        return self.values()

    def values(self) -> np.ndarray:
        """Return the outputs now, a fresh array (n_y,). Raises SubsystemError where one is not finite."""
        values = self._read(self._wired)
        if not math.isfinite(sum(values.tolist())):  # a fraction of numpy's time for a few numbers
            self._require_finite(values, "output")
        return values

    def record(self) -> np.ndarray:
        """Return the recorded variables now, a fresh array (n,)."""
        return self._read(self._recorded)

    def save(self, into: ctypes.c_void_p | None = None) -> ctypes.c_void_p:
        """Return a handle of the present state; `into` is an older handle to be written over."""
        state = ctypes.c_void_p() if into is None else into
        if state.value is not None and not self._overwrites:
            self.free(state)
            state.value = None
        old = state.value
        self._require_alive()
        self._check(self.library.fmi2GetFMUstate(self._component, ctypes.byref(state)), "fmi2GetFMUstate")
        if state.value != old and old is not None:
            # The old one may have moved or been left behind. Freeing it now could be once too often; from here on
            # the handle is freed before.
            self._states.pop(old, None)
            self._overwrites = False
        self._states[state.value] = self._steps
        self._oldest = min(self._states.values())
        return state

    def restore(self, state: ctypes.c_void_p) -> None:
        """Go back to a saved state; the handle stays valid."""
        self._require_alive()
        self._check(self.library.fmi2SetFMUstate(self._component, state), "fmi2SetFMUstate")
        self._steps = self._states.get(state.value, self._steps)

    def free(self, state: ctypes.c_void_p) -> None:
        """Release a handle."""
        if not self._loaded or self._states.pop(state.value, None) is None:
            return
        self._oldest = min(self._states.values(), default=NO_STATE)
        if not self._dead:
            self.library.fmi2FreeFMUstate(self._component, ctypes.byref(state))

    def close(self) -> None:
        """Release everything. May be called twice."""
        if not self._loaded:
            return
        for state in tuple(self._states):
            self.free(ctypes.c_void_p(state))
        if self._of_pythonfmu:
            # Its binaries are never unloaded, and at exit they count down in memory they have just freed, which can
            # abort the process, unless they let go of it before. Instances that live on hold it themselves.
            self._typed.finalizePythonInterpreter()
        if not self._dead:
            if self._component is not None:
                self._typed.fmi2FreeInstance(self._component)
            fmi2.unload_library(self._typed)
        self._log.close()
        self._loaded = False

    def watch_calls(self, wrap: Callable[[Any], Any]) -> None:
        """Replace the table of C functions by wrap(table), which may count or time the calls."""
        self.library = wrap(self.library)

    @property
    def component(self) -> ctypes.c_void_p:
        """Handle of the instance, as C functions take it."""
        return self._component

    def check(self, status: int, what: str) -> None:
        """Raise SubsystemError, with what the FMU logged, where the status of the call `what` is a failure."""
        self._check(status, what)

    @property
    def _of_pythonfmu(self) -> bool:
        return hasattr(self._typed, "finalizePythonInterpreter")

    def warnings(self) -> tuple[Warned, ...]:
        """Return what the FMU warned of, each kind once."""
        return tuple(self._log.warnings.values())

    def _instantiate(self, guid: str, categories: Sequence[str]) -> None:
        self._callbacks = fmi2.make_callbacks(RECEIVER, self._log.key)
        component = self._typed.fmi2Instantiate(
            self.name.encode(),
            self.kind,
            guid.encode(),
            (self._folder / "resources").as_uri().encode(),
            ctypes.byref(self._callbacks),
            fmi2.fmi2False,
            fmi2.fmi2True,  # without logging some keep errors to themselves
        )
        if component is None:
            raise SubsystemError(f"{self.name}: Failed to instantiate model: {self._log.take()}")
        self._component = ctypes.c_void_p(component)
        chatter = [name.encode() for name in categories if name in _CHATTER]
        if chatter:
            self._call("fmi2SetDebugLogging", fmi2.fmi2False, len(chatter), (fmi2.fmi2String * len(chatter))(*chatter))

    def _set_parameters(self, variables: Mapping[str, Variable], parameters: Mapping[str, Value]) -> None:
        if parameters != self._parameters:
            self._parameters, self._settings = dict(parameters), _grouped(variables, parameters)
        for group, values, names in self._settings:
            if group.write(self._typed, self._component, values) > fmi2.fmi2Warning:
                raise SubsystemError(f"{self.name}: setting {', '.join(names)}: {self._log.take()}")

    def _write_inputs(self, values: np.ndarray) -> None:
        status = self._driven.write(self.library, self._component, values)
        if status != fmi2.fmi2OK:
            self._check(status, "setting inputs")

    def _read(self, group: Group) -> np.ndarray:
        if group.real_only and group.size:
            status = self.library.fmi2GetReal(self._component, group.references, group.count, group.buffer)
        else:
            status = group.read(self.library, self._component)
        if status != fmi2.fmi2OK:
            self._check(status, "reading outputs")
        return group.values.copy()

    def _require_finite(self, values: np.ndarray, what: str) -> None:
        """Raise SubsystemError where one of the numbers of the outputs (n_y,) is not finite."""
        bad = [f"{self.outputs[k].name} is {values[k]}" for k in np.flatnonzero(~np.isfinite(values))]
        if bad:
            raise SubsystemError(
                f"{self.name}: {what} {', '.join(bad)} at t = {self._log.time:.6g} s, which is handed to no other FMU"
            )

    def _require_alive(self) -> None:
        if self._dead:
            raise SubsystemError(self._dead, fatal=True)

    def _call(self, function: str, *arguments: object) -> None:
        self._check(getattr(self._typed, function)(self._component, *arguments), function)

    def _check(self, status: int, what: str) -> None:
        """Raise SubsystemError for a call that failed; count a warning without words."""
        if status == fmi2.fmi2OK:
            return
        if status == fmi2.fmi2Warning:
            self._log.claim()
            if not self._log.messages:
                self._log.warn(f"{what} answered fmi2Warning and logged nothing")
            self._log.messages.clear()
            return
        said = self._log.take()
        text = f"{self.name}: {said if said.startswith(f'{what}: ') else f'{what}: {said}'}"
        if status == fmi2.fmi2Fatal:
            self._dead = text = f"{text}; a fatal error, after which it cannot go on"
        raise SubsystemError(text, fatal=status == fmi2.fmi2Fatal)


def _port(member: str, v: Variable) -> Port:
    """Return a variable as an interface of a subsystem."""
    if not math.isfinite(v.nominal):
        raise SubsystemError(
            f"{member}: the nominal value of {v.name} is {v.nominal} in modelDescription.xml, so its errors cannot be "
            "weighed; give it a finite one"
        )
    start = 0.0
    if v.start is not None and v.type != "String":
        with contextlib.suppress(OverflowError):
            start = float(v.start)
    return Port(
        v.name, v.unit, v.nominal, start if math.isfinite(start) else 0.0, v.least, v.most, v.discrete, v.has_nominal
    )


def _grouped(
    variables: Mapping[str, Variable], parameters: Mapping[str, Value]
) -> list[tuple[Group, np.ndarray, list[str]]]:
    """Return the parameters of each type as a group with its values and names."""
    settings = []
    for kind in TYPES:
        names = [name for name in parameters if variables[name].type == kind]
        if names:
            values = [number_of(str(parameters[name])) if kind == "String" else parameters[name] for name in names]
            settings.append((Group([variables[name] for name in names]), np.array(values, dtype=float), names))
    return settings
