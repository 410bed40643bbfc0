"""Macro steps in C++ (fmus/engine/block.h) in place of the master, where all subsystems are FMUs of this project.

Whatever is not the ordinary course is left to the master: the first steps of a loop after an event, steps that fail or
warn, and every scene that has something the C++ loop does not know. Results are those of the master to the last bit. So
that they are, sums come from the BLAS of numpy, and a check shows that both round alike (compiled_arithmetic.py).
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence

import numpy as np

from ..cosim.acceleration.quasi_newton import QuasiNewton
from ..cosim.master import Master, StepLog
from ..cosim.step_logs import StepBlock
from ..cosim.subsystem import Recorder
from ..errors import SubsystemError
from . import block_interface as c
from .block_memory import ComponentMemory, NodeMemory, fits
from .compiled_arithmetic import Arithmetic, address, find_arithmetic

__all__ = ["BlockSteps"]

FIRST_SIZE, MAX_SIZE = 512, 4096  # steps asked for at once
LIMIT = 0.03  # [s] of one block, so that progress is shown and Ctrl-C heard
WORTHWHILE = 8  # steps in a block that failed; after fewer, the master takes more steps before the next try
MAX_PAUSE = 64  # most of these


class BlockSteps:
    """Takes macro steps of a master in C++; see cosim.time_loop.BlockStepper. Made by of()."""

    def __init__(self, master: Master, recorders: Mapping[str, Recorder], arithmetic: Arithmetic) -> None:
        self._master, self._arithmetic = master, arithmetic
        self._nodes = [NodeMemory(node, master) for node in master.nodes]
        self._components = [ComponentMemory(component, master) for component in master.components]
        self._last_loop = next((each for each in reversed(self._components) if each.size), None)
        self._frozen = {name: system.record() for name, system in recorders.items() if system.frozen}
        ends = np.cumsum([node.recorded for node in self._nodes]).tolist()
        self._columns = {
            each.node.subsystem.name: slice(end - each.recorded, end)
            for each, end in zip(self._nodes, ends, strict=True)
        }
        self._names, self._width = tuple(recorders), ends[-1]
        self._varying = sum(len(each.node.varying) for each in self._nodes)
        self._size, self._pause, self._left = FIRST_SIZE, 0, 0

    @classmethod
    def of(cls, master: Master, recorders: Mapping[str, Recorder]) -> BlockSteps | None:
        """Return the stepper of a master that is initialised; None where it cannot take its steps.

        Parameters
        ----------
        master
            The master of a run with steps of one length.
        recorders
            The subsystems whose records make up a log's record, by name.
        """
        if not all(fits(node) for node in master.nodes):
            return None
        loops = [component.interface for component in master.components if component.interface.size]
        iterates = isinstance(master.settings.loop_method, QuasiNewton)
        if loops and (not iterates or any(loop.fits_nominals for loop in loops)):
            return None
        sources = {link.source for node in master.nodes for link in node.upstream + node.forward}
        outputs = {len(node.subsystem.outputs) for node in sources}
        arithmetic = find_arithmetic(frozenset(loop.size for loop in loops), frozenset(outputs))
        return None if arithmetic is None else cls(master, recorders, arithmetic)

    @property
    def size(self) -> int:
        """Number of steps to ask for now; 0 where the master has to take the next one."""
        if self._left:
            self._left -= 1
            return 0
        ready = all(component.is_ready(self._master) for component in self._components)
        return self._size if ready and all(node.is_ready() for node in self._nodes) else 0

    def take(self, times: np.ndarray, lengths: np.ndarray, ends: np.ndarray) -> Sequence[StepLog]:
        """Take steps from the first on, as many as succeed; the master is as if it had taken them."""
        master, count, time = self._master, len(times), float(times[0])
        if any(each.node.samples[-1].time != time for each in self._nodes):
            return []
        for each in self._nodes:
            each.load(master)
        for component in self._components:
            component.load(master)
        n = self._last_loop.size if self._last_loop else 0
        records, logs = np.zeros((count, self._width)), np.zeros((count, 3))
        combined, kept = np.zeros((count, n, 2 * n)), np.zeros(count, dtype=np.uintp)
        signals = self._signals(times, lengths)
        lengths, ends = np.ascontiguousarray(lengths), np.ascontiguousarray(ends)
        call = c.Steps(count, *(address(array) for array in (times, lengths, ends, signals)), limit=LIMIT)
        call.records, call.logs, call.combined, call.kept = (address(a) for a in (records, logs, combined, kept))
        done = self._call(call)
        failed = bool(call.failed)
        reached = float(times[done - 1] + lengths[done - 1]) if done else time
        for each in self._nodes:
            each.store(max(done, 0), reached, failed)
        for component in self._components:
            component.store(master)
        if done < 0:
            raise SubsystemError("a subsystem cannot be set back to the start of a step")
        master.seconds += call.seconds
        master.recording_seconds += call.recording_seconds
        self._plan_next(count, done, failed, call.seconds)
        columns = {"time": ends[:done], "step": lengths[:done], "sweeps": logs[:done, 0].astype(int)}
        columns |= {"residual": logs[:done, 1], "error": logs[:done, 2]}
        inverses = self._inverses(combined[:done], kept[:done])
        return StepBlock(columns, inverses, records[:done], self._columns, self._frozen, self._names)

    def _call(self, call: c.Steps) -> int:
        """Take the steps; return how many were taken, -1 where a state could not be restored."""
        nodes = (c.Node * len(self._nodes))(*(each.structure for each in self._nodes))
        components = (c.Component * len(self._components))(*(each.structure for each in self._components))
        settings = self._master.settings
        block = c.Block(
            nodes=len(nodes),
            node=nodes,
            components=len(components),
            component=components,
            blas=self._arithmetic.blas,
            tolerance=settings.tolerance,
            radius=settings.trust_radius,
            max_sweeps=settings.max_sweeps,
        )
        done = int(self._arithmetic.engine.tca_take_steps(ctypes.byref(block), ctypes.byref(call)))
        for each, structure in zip(self._nodes, nodes, strict=True):
            each.structure = structure
        for component, structure in zip(self._components, components, strict=True):
            component.structure = structure
        return done

    def _signals(self, times: np.ndarray, lengths: np.ndarray) -> np.ndarray:
        """Return the polynomials (steps, 4, n) of the inputs that signals change."""
        signals = np.zeros((len(times), 4, self._varying))
        column = 0
        steps = list(zip(times.tolist(), lengths.tolist(), strict=True))
        for each in self._nodes:
            for driven in each.node.varying:
                # Constant between events, and none lies between the steps of a block.
                chosen = steps[:1] if driven.signal.degree == 0 else steps
                signals[:, :, column] = [each.node.driven_polynomial(driven, time, length) for time, length in chosen]
                column += 1
        return signals

    def _plan_next(self, asked: int, done: int, failed: bool, seconds: float) -> None:
        """Choose the size of the next block, and how many steps the master takes before it."""
        if failed:
            self._pause = min(max(2 * self._pause, 1), MAX_PAUSE) if done < WORTHWHILE else 1
            self._left = self._pause if done else self._pause - 1  # the present one is the master's in any case
        else:
            self._pause = 0
            if done < asked:  # the time was over: signals of steps that are not taken are computed for nothing
                self._size = max(2 * done, 1)
            elif seconds < 0.5 * LIMIT:
                self._size = min(2 * self._size, MAX_SIZE)

    def _inverses(self, combined: np.ndarray, kept: np.ndarray) -> np.ndarray | list[np.ndarray | None]:
        """Return what the logs tell of the last loop, from its secants (steps, n, 2n) after each step."""
        if self._last_loop is None:
            return [None] * len(combined)
        inverse_of = self._master.history(self._last_loop.component).secants.inverse_of
        if (kept == self._last_loop.size).all():
            return np.asarray(inverse_of(combined))
        return [inverse_of(matrix[:count]) if count else None for matrix, count in zip(combined, kept, strict=True)]
