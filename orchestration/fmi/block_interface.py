"""The C interface of blocks of macro steps (fmus/engine/block.h) by ctypes."""

from __future__ import annotations

import ctypes
from ctypes import POINTER, c_double, c_int, c_size_t, c_uint, c_void_p

__all__ = ["FUNCTIONS", "Blas", "Block", "Component", "Group", "Node", "Steps"]

FUNCTIONS = {  # fields of Node -> names of the C functions that stand there, without fmi2
    "set_real": "SetReal",
    "set_input_derivatives": "SetRealInputDerivatives",
    "get_real": "GetReal",
    "get_output_derivatives": "GetRealOutputDerivatives",
    "do_step": "DoStep",
    "get_state": "GetFMUstate",
    "set_state": "SetFMUstate",
}

_DOUBLES, _SIZES = c_void_p, c_void_p  # addresses of arrays of numpy


class Blas(ctypes.Structure):
    """TcaBlas."""

    _fields_ = (*((name, c_void_p) for name in ("gemv", "gemm", "dot")), ("long_integers", c_int))


class Group(ctypes.Structure):
    """TcaGroup."""

    _fields_ = (("source", c_size_t), ("method", c_int), ("size", c_size_t), ("outputs", _SIZES), ("inputs", _SIZES))


class Node(ctypes.Structure):
    """TcaNode."""

    _fields_ = (
        *((name, c_void_p) for name in ("set_real", "set_input_derivatives", "get_real", "get_output_derivatives")),
        *((name, c_void_p) for name in ("do_step", "get_state", "set_state", "component")),
        *((name, c_size_t) for name in ("inputs", "outputs", "recorded")),
        *((name, POINTER(c_uint)) for name in ("input_references", "output_references", "recorded_references")),
        *((name, c_int) for name in ("needs_rates", "takes_polynomials", "accepted_degree")),
        ("varying", c_size_t),
        ("varying_columns", _SIZES),
        *((name, c_size_t) for name in ("upstream", "forward", "torn")),
        *((name, POINTER(Group)) for name in ("upstream_group", "forward_group", "torn_group")),
        ("polynomials", _DOUBLES),
        ("sent", _DOUBLES),
        ("has_sent", c_int),
        ("degree", c_int),
        ("samples", _DOUBLES),
        ("state", POINTER(c_void_p)),
        ("seconds", c_double),
        ("restores", c_size_t),
    )


class Component(ctypes.Structure):
    """TcaComponent."""

    _fields_ = (
        *((name, c_size_t) for name in ("first", "count", "size", "sources")),
        *((name, _SIZES) for name in ("source", "source_size", "output")),
        *((name, _DOUBLES) for name in ("scale", "columns", "combined")),
        ("kept", c_size_t),
        *((name, _DOUBLES) for name in ("times", "solutions")),
        ("solved", c_size_t),
    )


class Block(ctypes.Structure):
    """TcaBlock."""

    _fields_ = (
        ("nodes", c_size_t),
        ("node", POINTER(Node)),
        ("components", c_size_t),
        ("component", POINTER(Component)),
        ("blas", Blas),
        ("tolerance", c_double),
        ("radius", c_double),
        ("max_sweeps", c_size_t),
    )


class Steps(ctypes.Structure):
    """TcaSteps."""

    _fields_ = (
        ("steps", c_size_t),
        *((name, _DOUBLES) for name in ("times", "lengths", "ends", "signals")),
        ("limit", c_double),
        *((name, _DOUBLES) for name in ("records", "logs", "combined", "kept")),
        ("seconds", c_double),
        ("recording_seconds", c_double),
        ("failed", c_int),
    )
