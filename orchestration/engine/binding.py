"""The C interface of the engine (fmus/engine/engine.h) by ctypes."""

from __future__ import annotations

import ctypes
from ctypes import POINTER, c_char_p, c_double, c_int, c_size_t, c_ubyte, c_uint, c_void_p
from functools import lru_cache
from typing import Any

from ..errors import CosimError
from ..fmi.block_interface import Blas
from ..fmi.engine_library import has_layout, load_engine

__all__ = ["Link", "Member", "Part", "Plan", "Times", "Values", "Watch", "library"]


class Link(ctypes.Structure):
    """TcaLink."""

    _fields_ = (*((name, c_size_t) for name in ("source", "output", "input")), ("method", c_int), ("torn", c_int))


class Values(ctypes.Structure):
    """TcaValues."""

    _fields_ = (("size", c_size_t), ("references", POINTER(c_uint)), ("values", c_void_p))


class Member(ctypes.Structure):
    """TcaMember."""

    _fields_ = (
        *((name, c_char_p) for name in ("name", "library", "guid", "resources")),
        *((name, Values) for name in ("reals", "integers", "booleans", "strings")),
        ("varied", c_size_t),
        ("varied_references", POINTER(c_uint)),
        ("varied_columns", POINTER(c_size_t)),
        *((name, c_size_t) for name in ("inputs", "outputs", "recorded")),
        *((name, POINTER(c_uint)) for name in ("input_references", "output_references", "recorded_references")),
        ("links", c_size_t),
        ("link", POINTER(Link)),
        ("needs_rates", c_int),
        ("input_degree", c_int),
    )


class Part(ctypes.Structure):
    """TcaPart."""

    _fields_ = (
        *((name, c_size_t) for name in ("first", "count", "unknowns")),
        *((name, POINTER(c_size_t)) for name in ("source", "output")),
        ("nominals", POINTER(c_double)),
    )


class Plan(ctypes.Structure):
    """TcaPlan."""

    _fields_ = (
        ("members", c_size_t),
        ("member", POINTER(Member)),
        ("parts", c_size_t),
        ("part", POINTER(Part)),
        ("coupling_tolerance", c_double),
        ("reach", c_double),
        ("max_sweeps", c_size_t),
        ("blas", Blas),
        *((name, c_double) for name in ("start", "stop", "tolerance")),
        ("steps", c_size_t),
        *((name, POINTER(c_double)) for name in ("times", "lengths", "ends")),
        ("events", POINTER(c_ubyte)),
        *((name, POINTER(c_double)) for name in ("polynomials", "starts")),
        ("driven", c_size_t),
        ("driven_columns", POINTER(c_size_t)),
    )


class Times(ctypes.Structure):
    """TcaTimes."""

    _fields_ = (
        *((name, c_size_t) for name in ("steps", "misses", "own_misses", "allocations", "sweeps")),
        *((name, c_double) for name in ("period", "worst", "worst_lateness")),
        ("locked", c_int),
        ("scheduled", c_int),
        ("core", c_int),
    )


class Watch(ctypes.Structure):
    """TcaWatch."""

    _fields_ = (("stop", c_int), ("done", c_size_t))


@lru_cache(maxsize=1)
def library() -> Any:
    """Load the engine and declare the types of its functions.

    Raises
    ------
    CosimError
        It is missing, or not for this machine or this version of the package.
    """
    loaded = load_engine()
    if not has_layout(loaded, "tca_plan_layout", (Link, Values, Member, Part, Plan, Times, Watch)):
        raise CosimError(
            f"{loaded._name} belongs to another version of this package; run `make fmus`, or install the package again"
        )
    array = POINTER(c_double)
    texts = (c_char_p, c_char_p, c_size_t)
    batch = (POINTER(Plan), c_size_t, c_size_t, array, array, array, c_size_t, *texts, POINTER(Watch))
    paced = (POINTER(Plan), array, array, array, array, array, POINTER(Times), *texts, POINTER(Watch))
    loaded.tca_realtime.argtypes, loaded.tca_realtime.restype = paced, c_int
    loaded.tca_batch.argtypes, loaded.tca_batch.restype = batch, c_int
    return loaded
