"""Groups of variables that are read or written together, as arrays of numbers.

Integers and enumerations are numbers as they are, Booleans 0 and 1, strings the numbers that `number_of` gives them in
this process. Value references and buffers are prepared once; a group of Reals alone costs one bare C call.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import fmi2
from .variables import Variable

__all__ = ["Group", "number_of", "text_of"]

_TEXTS: list[str] = []
_NUMBERS: dict[str, int] = {}
_C_TYPES: dict[str, Any] = {"Real": fmi2.fmi2Real, "Integer": fmi2.fmi2Integer, "Boolean": fmi2.fmi2Boolean}
_C_TYPES["String"] = fmi2.fmi2String


def number_of(text: str) -> int:
    """Return the number that stands for a string in this process."""
    number = _NUMBERS.setdefault(text, len(_TEXTS))
    if number == len(_TEXTS):
        _TEXTS.append(text)
    return number


def text_of(number: float) -> str:
    """Return the string that a number stands for."""
    return _TEXTS[int(number)]


class Group:
    """Variables that are read or written together.

    Attributes
    ----------
    values : ndarray, (size,)
        Numbers of the last call.
    references, count, buffer
        C arguments of the group if all variables are Real, else of its Real variables.
    """

    def __init__(self, variables: Sequence[Variable]) -> None:
        self.size = len(variables)
        self.values = np.zeros(self.size)
        self._parts = [_Part(kind, variables) for kind in _C_TYPES if any(_c_type(v) == kind for v in variables)]
        self.real_only = all(part.kind == "Real" for part in self._parts)
        reals = [v for v in variables if v.type == "Real"]
        self.references = (fmi2.fmi2ValueReference * len(reals))(*(v.reference for v in reals))
        self.count = ctypes.c_size_t(len(reals))
        self.buffer = (fmi2.fmi2Real * self.size).from_buffer(self.values) if self.real_only else None

    def read(self, library: Any, component: ctypes.c_void_p) -> int:
        """Fill `values` from the FMU; the worst status."""
        return max((part.read(library, component, self.values) for part in self._parts), default=fmi2.fmi2OK)

    def write(self, library: Any, component: ctypes.c_void_p, values: np.ndarray) -> int:
        """Set the variables to values (size,); the worst status."""
        if not self.size:
            return fmi2.fmi2OK
        self.values[:] = values
        if self.real_only:
            return int(library.fmi2SetReal(component, self.references, self.count, self.buffer))
        return max(part.write(library, component, self.values) for part in self._parts)


class _Part:
    """The variables of one C type in a group."""

    def __init__(self, kind: str, variables: Sequence[Variable]) -> None:
        self.kind = kind
        self.columns = np.array([k for k, v in enumerate(variables) if _c_type(v) == kind], dtype=int)
        references = [variables[k].reference for k in self.columns]
        self.references = (fmi2.fmi2ValueReference * len(references))(*references)
        self.count = ctypes.c_size_t(len(references))
        self.buffer = (_C_TYPES[kind] * len(references))()

    def read(self, library: Any, component: ctypes.c_void_p, values: np.ndarray) -> int:
        get = getattr(library, f"fmi2Get{self.kind}")
        status = int(get(component, self.references, self.count, self.buffer))
        if status <= fmi2.fmi2Warning:
            numbers: Any = list(self.buffer)
            if self.kind == "String":
                numbers = [number_of((text or b"").decode("utf-8", "replace")) for text in numbers]
            values[self.columns] = numbers
        return status

    def write(self, library: Any, component: ctypes.c_void_p, values: np.ndarray) -> int:
        numbers = values[self.columns]
        if self.kind == "Real":
            self.buffer[:] = numbers.tolist()
        elif self.kind == "String":
            self.buffer[:] = [text_of(number).encode() for number in numbers]
        else:
            self.buffer[:] = [int(number) for number in numbers]
        return int(getattr(library, f"fmi2Set{self.kind}")(component, self.references, self.count, self.buffer))


def _c_type(variable: Variable) -> str:
    return "Integer" if variable.type == "Enumeration" else variable.type
