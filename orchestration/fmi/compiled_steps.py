"""Steps of one FMU instance alone in C++, as a host written in C takes them (tca_step_alone of fmus/engine/block.h)."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np

from ..errors import SubsystemError
from . import block_interface as c
from .compiled_arithmetic import address
from .engine_library import load_block_engine
from .slave import Slave

__all__ = ["compiled_steps"]


def compiled_steps(slave: Slave, stops: np.ndarray) -> Callable[[], np.ndarray] | None:
    """Return what takes an instance without driven inputs through its steps once, without saving states.

    Parameters
    ----------
    slave
        Initialised; at time 0.
    stops : ndarray, shape (steps,)
        Ends of the steps [s].

    Returns
    -------
    callable or None
        Returns the recorded numbers (steps, n) at the ends; raises SubsystemError where a step fails. None where the
        engine is not built.
    """
    engine = load_block_engine()
    if engine is None:
        return None
    take_steps = engine.tca_step_alone
    take_steps.restype = ctypes.c_size_t
    references = slave.block_references()
    node = c.Node(component=slave.component, recorded=len(references[2]))
    node.recorded_references = references[2]
    for field in ("do_step", "get_real"):
        setattr(node, field, slave.block_functions[field])
    begins = np.concatenate([[0.0], stops[:-1]])
    lengths, ends = stops - begins, np.ascontiguousarray(stops)
    rows = np.zeros((len(stops), len(references[2])))
    call = c.Steps(len(stops), *map(address, (begins, lengths, ends)), records=address(rows))
    memory = (references, begins, lengths, ends)  # lives as long as take()

    def take(memory: object = memory) -> np.ndarray:
        done = take_steps(ctypes.byref(node), ctypes.byref(call))
        if done < len(stops):
            said = slave.log.take()
            raise SubsystemError(f"{slave.name}: step from t = {begins[done]:.6g} s: {said}", float(begins[done]))
        return rows

    return take
