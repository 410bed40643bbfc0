"""C types, constants and libraries of FMI 2.0 by ctypes, under the names of the standard (fmi2Functions.h).

FMPy has the same bindings, but importing it takes half as long as a whole run from the command line. Of it only the C
function that formats log messages is used here; descriptions are read by it (archive.py) the first time.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections.abc import Callable
from ctypes import POINTER, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

__all__ = [
    "CO_SIMULATION",
    "LIBRARY_ENDING",
    "MODEL_EXCHANGE",
    "PLATFORM",
    "fmi2Boolean",
    "fmi2CallbackFunctions",
    "fmi2CallbackLoggerTYPE",
    "fmi2Discard",
    "fmi2Error",
    "fmi2EventInfo",
    "fmi2False",
    "fmi2Fatal",
    "fmi2Integer",
    "fmi2LastSuccessfulTime",
    "fmi2OK",
    "fmi2Real",
    "fmi2String",
    "fmi2Terminated",
    "fmi2True",
    "fmi2ValueReference",
    "fmi2Warning",
    "load_library",
    "make_callbacks",
    "unload_library",
    "untyped",
]

# Typed as Any, for type checkers do not know that arrays of numpy are buffers.
fmi2ValueReference: Any = c_uint
fmi2Real: Any = c_double
fmi2Integer: Any = c_int
fmi2Boolean: Any = c_int
fmi2String: Any = c_char_p
fmi2False, fmi2True = 0, 1
fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal = range(5)  # of fmi2Status
fmi2LastSuccessfulTime, fmi2Terminated = 2, 3  # of fmi2StatusKind
MODEL_EXCHANGE, CO_SIMULATION = 0, 1  # of fmi2Type

fmi2CallbackLoggerTYPE = ctypes.CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)
_Allocate = ctypes.CFUNCTYPE(c_void_p, c_size_t, c_size_t)
_Free = ctypes.CFUNCTYPE(None, c_void_p)
_StepFinished = ctypes.CFUNCTYPE(None, c_void_p, c_int)


class fmi2CallbackFunctions(ctypes.Structure):
    """Functions that an FMU calls."""

    _fields_ = (
        ("logger", fmi2CallbackLoggerTYPE),
        ("allocateMemory", _Allocate),
        ("freeMemory", _Free),
        ("stepFinished", _StepFinished),
        ("componentEnvironment", c_void_p),
    )


class fmi2EventInfo(ctypes.Structure):
    """What fmi2NewDiscreteStates says."""

    _fields_ = (
        ("newDiscreteStatesNeeded", c_int),
        ("terminateSimulation", c_int),
        ("nominalsOfContinuousStatesChanged", c_int),
        ("valuesOfContinuousStatesChanged", c_int),
        ("nextEventTimeDefined", c_int),
        ("nextEventTime", c_double),
    )


_OPERATING_SYSTEM = {"win32": "win", "linux": "linux", "darwin": "darwin"}.get(sys.platform, sys.platform)
PLATFORM = f"{_OPERATING_SYSTEM}{64 if sys.maxsize > 2**32 else 32}"  # folder of binaries: linux64, win64, darwin64
LIBRARY_ENDING = {"win": ".dll", "darwin": ".dylib"}.get(_OPERATING_SYSTEM, ".so")

# Arguments of the functions that both interfaces have, and of those of one; every one returns fmi2Status but for the
# first two. c: instance, p: other pointer, s: text, i: int, n: size_t, d: double.
_COMMON = {
    "Instantiate": "sisspii",
    "FreeInstance": "c",
    "SetDebugLogging": "cinp",
    "SetupExperiment": "ciddid",
    "EnterInitializationMode": "c",
    "ExitInitializationMode": "c",
    "Terminate": "c",
    "Reset": "c",
    **{f"{verb}{kind}": "cpnp" for verb in ("Get", "Set") for kind in ("Real", "Integer", "Boolean", "String")},
    "GetFMUstate": "cp",
    "SetFMUstate": "cp",
    "FreeFMUstate": "cp",
    "SerializedFMUstateSize": "cpp",
    "SerializeFMUstate": "cppn",
    "DeSerializeFMUstate": "cpnp",
    "GetDirectionalDerivative": "cpnpnpp",
}
_OWN = {
    MODEL_EXCHANGE: {
        "EnterEventMode": "c",
        "NewDiscreteStates": "cp",
        "EnterContinuousTimeMode": "c",
        "CompletedIntegratorStep": "cipp",
        "SetTime": "cd",
        "SetContinuousStates": "cpn",
        "GetDerivatives": "cpn",
        "GetEventIndicators": "cpn",
        "GetContinuousStates": "cpn",
        "GetNominalsOfContinuousStates": "cpn",
    },
    CO_SIMULATION: {
        "SetRealInputDerivatives": "cpnpp",
        "GetRealOutputDerivatives": "cpnpp",
        "DoStep": "cddi",
        "CancelStep": "c",
        "GetStatus": "cip",
        "GetRealStatus": "cip",
        "GetIntegerStatus": "cip",
        "GetBooleanStatus": "cip",
        "GetStringStatus": "cip",
    },
}
_TYPES: dict[str, Any] = {"c": c_void_p, "p": c_void_p, "s": c_char_p, "i": c_int, "n": c_size_t, "d": c_double}


def load_library(path: Path, interface: int) -> ctypes.CDLL:
    """Load the shared library of an FMU; its functions have their types of arguments.

    Parameters
    ----------
    path
        The library.
    interface
        MODEL_EXCHANGE or CO_SIMULATION.

    Raises
    ------
    OSError
        It cannot be loaded.
    AttributeError
        It lacks a function of the interface.
    """
    before = os.getcwd()
    os.chdir(path.parent)  # some libraries find what they depend on there
    try:
        library = ctypes.CDLL(str(path.absolute()))
    finally:
        os.chdir(before)
    try:
        for name, codes in {**_COMMON, **_OWN[interface]}.items():
            getattr(library, f"fmi2{name}").argtypes = [_TYPES[code] for code in codes]
    except AttributeError:
        unload_library(library)
        raise
    library.fmi2Instantiate.restype = c_void_p
    library.fmi2FreeInstance.restype = None
    return library


def untyped(library: ctypes.CDLL) -> ctypes.CDLL:
    """Return the functions of a library without types of arguments.

    Their conversions take longer than most calls; here every argument is a value or an array of ctypes.
    """
    return ctypes.CDLL(library._name, handle=library._handle)


def unload_library(library: ctypes.CDLL) -> None:
    """Release one use of a library."""
    system: Any = ctypes
    unload = system.windll.kernel32.FreeLibrary if os.name == "nt" else ctypes.CDLL(None).dlclose
    unload.argtypes = [c_void_p]
    unload(library._handle)


def make_callbacks(logger: Any, environment: int) -> fmi2CallbackFunctions:
    """Return the functions that an instance calls.

    Parameters
    ----------
    logger
        A fmi2CallbackLoggerTYPE, which receives messages with their arguments filled in.
    environment
        Number that the instance hands to the logger.
    """
    allocate, free = _memory()
    callbacks = fmi2CallbackFunctions(logger, allocate, free, _StepFinished(), environment)
    _add_logger_proxy()(ctypes.byref(callbacks))
    return callbacks


@lru_cache(maxsize=1)
def _memory() -> tuple[Any, Any]:
    """Return calloc and free of the C library."""
    library = ctypes.cdll.msvcrt if os.name == "nt" else ctypes.CDLL(None)
    return ctypes.cast(library.calloc, _Allocate), ctypes.cast(library.free, _Free)


@lru_cache(maxsize=1)
def _add_logger_proxy() -> Callable[[Any], None]:
    """Return FMPy's function that puts a C function in front of a logger, which formats messages as printf does."""
    spec = find_spec("fmpy")
    if spec is not None and spec.origin is not None:
        with contextlib.suppress(OSError, AttributeError):
            file = Path(spec.origin).parent / "logging" / PLATFORM / f"logging{LIBRARY_ENDING}"
            add: Any = ctypes.CDLL(str(file)).addLoggerProxy
            add.argtypes, add.restype = [POINTER(fmi2CallbackFunctions)], None
            return add  # type: ignore[no-any-return]
    from fmpy.logging import addLoggerProxy  # where it lies elsewhere in this version

    return addLoggerProxy  # type: ignore[no-any-return]
