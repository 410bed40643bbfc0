"""Instances in processes of their own, for FMUs that allow one instance per process.

The subsystem here sends each call of the protocol (cosim/subsystem.py) through a pipe to the process of the instance.
Only scenes that use such an FMU twice pay for it.
"""

from __future__ import annotations

import contextlib
import itertools
import multiprocessing.connection
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import SubsystemError, TerminationRequest
from .archive import Archive
from .log import Warned
from .model_exchange import ModelExchangeInstance
from .slave import Slave
from .values import number_of, text_of
from .variables import Value, Variable

__all__ = ["IsolatedInstance", "serve"]

PATIENCE = 10.0  # [s] that the process has to end by itself
_PROGRAM = (
    "import importlib, sys; sys.path[:] = sys.argv[3:]; importlib.import_module(sys.argv[1]).serve(int(sys.argv[2]))"
)
_FACTS = ("inputs", "outputs", "has_rates", "can_rollback", "takes_polynomials")
Texts = dict[int, str]  # index of a String variable -> its text; numbers of strings differ between processes


class IsolatedInstance:
    """An instance for co-simulation or model exchange in a process of its own.

    Parameters
    ----------
    archive
        The FMU.
    name
        Name of the instance.
    parameters
        Name -> value in the variable's own unit.
    **settings
        Inputs, outputs, recorded, start, stop and tolerance, as Instance takes them.

    Raises
    ------
    SubsystemError
        The FMU cannot be loaded or refuses a value, or its process ends.
    """

    frozen = False

    def __init__(self, archive: Archive, name: str, parameters: Mapping[str, Value], **settings: Any) -> None:
        self.name = name
        self._strings = {
            key: _strings([archive.variables[v] for v in settings[key]]) for key in ("inputs", "outputs", "recorded")
        }
        self._warnings: tuple[Warned, ...] = ()
        self._connection, far = multiprocessing.connection.Pipe()
        module = f"{__package__}.isolated"
        self._process = subprocess.Popen(
            [sys.executable, "-c", _PROGRAM, module, str(far.fileno()), *sys.path], pass_fds=[far.fileno()]
        )
        far.close()
        self._connection.send((archive.path, name, dict(parameters), settings))
        try:
            self._take_facts(self._receive())
        except BaseException:
            self.close()
            raise

    def _take_facts(self, facts: Mapping[str, Any]) -> None:
        self.inputs, self.outputs = facts["inputs"], facts["outputs"]
        self.has_rates, self.takes_polynomials = facts["has_rates"], facts["takes_polynomials"]
        self.can_rollback = facts["can_rollback"]

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        """Set the inputs (n_u,) at the start; return the outputs (n_y,)."""
        return self._numbers("outputs", self._call("initialise", time, values, self._texts(values)))

    def begin(self) -> None:
        """End initialisation."""
        self._take_facts(self._call("begin"))

    def accepted_input_order(self, order: int) -> int:
        """Return the highest order, at most `order`, of input derivatives that the FMU takes."""
        accepted: int = self._call("accepted_input_order", order)
        return accepted

    def set_inputs(self, polynomials: np.ndarray) -> None:
        """Set the inputs (4, n_u) for the step to come."""
        self._call("set_inputs", polynomials, self._texts(polynomials[0]))

    def step(self, time: float, length: float) -> None:
        """Advance from time by length [s]. Raises SubsystemError, TerminationRequest."""
        self._call("step", time, length)

    def values(self) -> np.ndarray:
        """Return the outputs (n_y,) now, a new array."""
        return self._numbers("outputs", self._call("values"))

    def record(self) -> np.ndarray:
        """Return the recorded variables (n,) now, a new array."""
        return self._numbers("recorded", self._call("record"))

    def rates(self) -> np.ndarray:
        """Return the time derivatives (n_y,) of the outputs now."""
        rates: np.ndarray = self._call("rates")
        return rates

    def tangent(self, columns: np.ndarray) -> np.ndarray | None:
        """Return the derivatives (n_y, n) of the outputs by the inputs of these columns (n,); None if not offered."""
        tangent: np.ndarray | None = self._call("tangent", columns)
        return tangent

    def save(self, into: int | None = None) -> int:
        """Return a handle of the present state; `into` is an older one to be overwritten."""
        handle: int = self._call("save", into)
        return handle

    def restore(self, state: int) -> None:
        """Return to a saved state; the handle stays valid."""
        self._call("restore", state)

    def free(self, state: int) -> None:
        """Release a handle."""
        if self._process.poll() is None:
            self._call("free", state)

    def warnings(self) -> tuple[Warned, ...]:
        """Return what the FMU warned of, each kind once."""
        return self._warnings

    def watch_calls(self, wrap: Callable[[Any], Any]) -> None:
        """Refuse: the table of C functions is in another process. Raises SubsystemError."""
        raise SubsystemError(f"{self.name}: calls cannot be watched, for it runs in a process of its own")

    def close(self) -> None:
        """End the process. May be called twice."""
        if not self._connection.closed:
            self._connection.close()
            try:
                self._process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()

    def _texts(self, values: np.ndarray) -> Texts:
        return {k: text_of(values[k]) for k in self._strings["inputs"]}

    def _numbers(self, group: str, answer: tuple[np.ndarray, Texts]) -> np.ndarray:
        values, texts = answer
        for k in self._strings[group]:
            values[k] = number_of(texts[k])
        return values

    def _call(self, method: str, *arguments: object) -> Any:
        try:
            self._connection.send((method, arguments))
        except OSError as error:
            raise self._death() from error
        return self._receive()

    def _receive(self) -> Any:
        try:
            answer, failure, self._warnings = self._connection.recv()
        except (EOFError, OSError) as error:
            raise self._death() from error
        if failure is not None:
            text, reached, fatal, terminated = failure
            raise TerminationRequest(text, reached) if terminated else SubsystemError(text, reached, fatal)
        return answer

    def _death(self) -> SubsystemError:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(PATIENCE)
        return SubsystemError(f"{self.name}: its process ended (exit code {self._process.poll()})", fatal=True)


def _strings(variables: Sequence[Variable]) -> tuple[int, ...]:
    return tuple(k for k, v in enumerate(variables) if v.type == "String")


def serve(descriptor: int) -> None:
    """Hold one instance and answer the calls that come through a pipe, until it is closed."""
    connection = multiprocessing.connection.Connection(os.dup(descriptor))
    os.close(descriptor)
    try:
        path, name, parameters, settings = connection.recv()
    except EOFError:
        return
    try:
        server = _Server(path, name, parameters, settings)
    except Exception as error:
        connection.send((None, (str(error), None, False, False), ()))
        return
    connection.send((server.facts(), None, server.instance.warnings()))
    try:
        while True:
            method, arguments = connection.recv()
            answer, failure = server.answer(method, arguments)
            connection.send((answer, failure, server.instance.warnings()))
    except (EOFError, OSError):
        pass
    finally:
        server.close()


class _Server:
    """The instance in its process, with the handles of its saved states."""

    def __init__(self, path: Path, name: str, parameters: Mapping[str, Value], settings: Mapping[str, Any]) -> None:
        self.archive = Archive(path)
        kind = ModelExchangeInstance if self.archive.description.co_simulation is None else Slave
        self.strings = [_strings([self.archive.variables[v] for v in settings[key]]) for key in ("outputs", "recorded")]
        try:
            self.instance: Any = kind(self.archive, name, parameters, **settings)
        except BaseException:
            self.archive.close()
            raise
        self._handles: dict[int, Any] = {}
        self._numbers = itertools.count()

    def facts(self) -> dict[str, Any]:
        return {key: getattr(self.instance, key) for key in _FACTS}

    def answer(self, method: str, arguments: tuple[Any, ...]) -> tuple[Any, tuple[Any, ...] | None]:
        """Return the answer to a call and None, or None and the failure."""
        try:
            return getattr(self, f"_{method}", getattr(self.instance, method))(*arguments), None
        except SubsystemError as error:
            return None, (str(error), error.reached, error.fatal, isinstance(error, TerminationRequest))

    def _initialise(self, time: float, values: np.ndarray, texts: Texts) -> tuple[np.ndarray, Texts]:
        return _with_texts(self.instance.initialise(time, _with_numbers(values, texts)), self.strings[0])

    def _begin(self) -> dict[str, Any]:
        self.instance.begin()
        return self.facts()

    def _set_inputs(self, polynomials: np.ndarray, texts: Texts) -> None:
        _with_numbers(polynomials[0], texts)
        self.instance.set_inputs(polynomials)

    def _values(self) -> tuple[np.ndarray, Texts]:
        return _with_texts(self.instance.values(), self.strings[0])

    def _record(self) -> tuple[np.ndarray, Texts]:
        return _with_texts(self.instance.record(), self.strings[1])

    def _save(self, into: int | None) -> int:
        number = next(self._numbers) if into is None else into
        self._handles[number] = self.instance.save(self._handles.get(number))
        return number

    def _restore(self, state: int) -> None:
        self.instance.restore(self._handles[state])

    def _free(self, state: int) -> None:
        handle = self._handles.pop(state, None)
        if handle is not None:
            self.instance.free(handle)

    def close(self) -> None:
        self.instance.close()
        self.archive.close()


def _with_numbers(values: np.ndarray, texts: Texts) -> np.ndarray:
    """Return the values with the numbers that texts have in this process."""
    for k, text in texts.items():
        values[k] = number_of(text)
    return values


def _with_texts(values: np.ndarray, strings: Sequence[int]) -> tuple[np.ndarray, Texts]:
    return values, {k: text_of(values[k]) for k in strings}
