"""Sums of the C++ loop that round as the master's: the BLAS of numpy, and a check that both give the same bits."""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..cosim.acceleration.secants import Secants, norm
from ..cosim.extrapolation import METHODS, Sample
from . import block_interface as c
from .engine_library import load_block_engine

__all__ = ["Arithmetic", "address", "find_arithmetic"]

NAMES = (("scipy_cblas_{}64_", True), ("cblas_{}64_", True), ("cblas_{}", False))  # symbols, and 64-bit integers
TRIALS = 20  # of the check, with random numbers


@dataclass(frozen=True, eq=False)
class Arithmetic:
    """The engine with the functions that it takes its sums from."""

    engine: ctypes.CDLL
    blas: c.Blas


def address(array: np.ndarray) -> int:
    """Return the address of an array's memory, which the caller keeps."""
    return int(array.ctypes.data)


def find_arithmetic(unknowns: frozenset[int], outputs: frozenset[int]) -> Arithmetic | None:
    """Return what a C++ loop computes with.

    Parameters
    ----------
    unknowns
        Numbers of unknowns of its algebraic loops.
    outputs
        Numbers of outputs of its subsystems.

    Returns
    -------
    Arithmetic or None
        None where there is no engine, where numpy's BLAS is not found, or where the two round differently.
    """
    arithmetic = _arithmetic()
    if arithmetic is None or not all(_secants_agree(n) for n in unknowns):
        return None
    return arithmetic if all(_cubics_agree(n) for n in outputs) else None


@lru_cache(maxsize=1)
def _arithmetic() -> Arithmetic | None:
    engine = load_block_engine()
    if engine is None:
        return None
    engine.tca_take_steps.restype = ctypes.c_long
    engine.tca_norm.restype = ctypes.c_double
    blas = _blas_of_numpy()
    return None if blas is None else Arithmetic(engine, blas)


def _blas_of_numpy() -> c.Blas | None:
    """Return the functions that numpy's dot() calls: the extension module's own dependencies hold them."""
    core: Any = getattr(np, "_core", None) or np.core
    extension = ctypes.CDLL(core._multiarray_umath.__file__)
    for name, long_integers in NAMES:
        try:
            functions = [getattr(extension, name.format(function)) for function in ("dgemv", "dgemm", "ddot")]
        except AttributeError:
            continue
        addresses = [ctypes.cast(function, ctypes.c_void_p) for function in functions]
        return c.Blas(*addresses, long_integers)
    return None


def _numbers(*shape: int) -> np.ndarray:
    """Return numbers of many sizes and both signs, always the same. Not numpy's generators: they take time to load."""
    count = np.arange(1, math.prod(shape) + 1)
    numbers: np.ndarray = np.sin(1.7 * count * count) * 10.0 ** (count * 7919 % 7 - 3)
    return numbers.reshape(shape)


@lru_cache(maxsize=64)
def _secants_agree(n: int) -> bool:
    """Compare secants and norm of n unknowns with the master's."""
    engine, blas = _require()
    secants, columns, combined = Secants(n), np.zeros((n, 2 * n)), np.zeros((n, 2 * n))
    loop = c.Component(size=n, columns=address(columns), combined=address(combined))
    split = np.zeros(2 * n)
    for dx, dr, r in _numbers(TRIALS, 3, n):
        secants.add(dx, dr)
        engine.tca_secants(
            ctypes.byref(blas), ctypes.byref(loop), *(ctypes.c_void_p(address(v)) for v in (dx, dr, r, split))
        )
        same = loop.kept == len(secants.columns) and _equal(split, np.concatenate(secants.split(r)))
        same = same and _equal(combined[: loop.kept], secants.combined)
        same = same and engine.tca_norm(ctypes.c_void_p(address(r)), ctypes.c_size_t(n)) == norm(r)
        if not same:
            return False
    return True


@lru_cache(maxsize=64)
def _cubics_agree(n: int) -> bool:
    """Compare cubics of n outputs with the master's."""
    engine, blas = _require()
    cubic = np.zeros((4, n))
    for value, slope, end, last in _numbers(TRIALS, 4, n):
        start, stop = float(abs(value[0])), float(abs(value[0]) + abs(end[0]))
        samples = (Sample(start, value, slope), Sample(stop, end, last))
        rows = [np.r_[start, value, slope], np.r_[stop, end, last]]
        engine.tca_cubic(
            ctypes.byref(blas),
            ctypes.c_size_t(n),
            *(ctypes.c_void_p(address(array)) for array in (*rows, cubic)),
        )
        if not _equal(cubic, METHODS["hermite"].fit(samples, start)):
            return False
    return True


def _require() -> tuple[ctypes.CDLL, c.Blas]:
    arithmetic = _arithmetic()
    assert arithmetic is not None, "find_arithmetic() asks only where there is one"
    return arithmetic.engine, arithmetic.blas


def _equal(one: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.array_equal(one, other))
