"""Steps of one FMU instance alone in C++, as a host written in C takes them (tca_take_steps of fmus/engine/block.h)."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np

from ..errors import SubsystemError
from . import block_interface as c
from .block_memory import FUNCTIONS
from .compiled_arithmetic import address, find_arithmetic
from .slave import Slave

__all__ = ["compiled_steps"]


def compiled_steps(slave: Slave, stops: np.ndarray) -> Callable[[], np.ndarray] | None:
    """Return what takes an instance without driven inputs through its steps once.

    Parameters
    ----------
    slave
        Initialised; at time 0. Its state is saved for every step, and freed with it.
    stops : ndarray, shape (steps,)
        Ends of the steps [s].

    Returns
    -------
    callable or None
        Returns the recorded numbers (steps, n) at the ends; raises SubsystemError where a step fails. None where the
        engine is not built.
    """
    arithmetic = find_arithmetic(frozenset(), frozenset())
    if arithmetic is None:
        return None
    references = slave.block_references()
    state = ctypes.c_void_p()
    node = c.Node(component=slave.component, recorded=len(references[2]), state=ctypes.pointer(state))
    node.input_references, node.output_references, node.recorded_references = references
    for field, function in FUNCTIONS.items():
        setattr(node, field, ctypes.cast(getattr(slave.library, f"fmi2{function}"), ctypes.c_void_p))
    samples = np.zeros((3, 1))
    node.samples = address(samples)
    component = c.Component(first=0, count=1)
    block = c.Block(1, ctypes.pointer(node), 1, ctypes.pointer(component), arithmetic.blas, max_sweeps=1)
    begins = np.concatenate([[0.0], stops[:-1]])
    lengths, ends = stops - begins, np.ascontiguousarray(stops)
    rows, logs, kept = np.zeros((len(stops), len(references[2]))), np.zeros((len(stops), 3)), np.zeros(1)
    memory = (references, state, samples, node, component, kept)  # lives as long as take()

    def take(memory: object = memory) -> np.ndarray:
        done = 0
        while done < len(stops):
            arrays = (address(array[done:]) for array in (begins, lengths, ends))
            call = c.Steps(len(stops) - done, *arrays, address(kept), limit=np.inf, records=address(rows[done:]))
            call.logs = address(logs)
            taken = arithmetic.engine.tca_take_steps(ctypes.byref(block), ctypes.byref(call))
            if taken < 0:
                raise SubsystemError(f"{slave.name} cannot be set back to the start of a step")
            done += taken
            if done < len(stops):  # a step that warns or fails is taken once more, for its message
                slave.step(float(begins[done]), float(lengths[done]))
                rows[done] = slave.record()
                done += 1
        return rows

    return take
