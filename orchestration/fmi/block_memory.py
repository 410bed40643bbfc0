"""Memory that the C++ loop shares with the master: one structure for each subsystem and each component."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from ..cosim.acceleration import KEPT, LEAST
from ..cosim.extrapolation import Sample
from ..cosim.graph import WiredComponent
from ..cosim.master import Master
from ..cosim.node import Columns, Link, Node
from . import block_interface as c
from .compiled_arithmetic import address
from .log import Warned
from .slave import Slave

__all__ = ["METHODS", "SAMPLES", "ComponentMemory", "NodeMemory", "fits"]

METHODS = {"held": 0, "linear": 1, "hermite": 3}  # polynomials that the loop knows: their numbers in engine.h
TORN_METHODS = ("held", "linear")
SAMPLES = 3  # of each subsystem that the master keeps; the polynomials that the loop knows need the newest alone


def fits(node: Node) -> bool:
    """Return whether the C++ loop knows all that a node has."""
    links = node.moving_upstream + node.forward
    if node.delayed or any(link.held for link in node.upstream + node.forward + node.torn):
        return False
    if any(link.method.name not in METHODS for link in links) or any(
        link.method.name not in TORN_METHODS for link in node.torn
    ):
        return False
    if any(link.method.needs_derivatives and not link.source.needs_rates for link in links):
        return False
    return node.subsystem.frozen or (type(node.subsystem) is Slave and node.subsystem.runs_in_blocks)


class NodeMemory:
    """A node of the master for the loop.

    Attributes
    ----------
    node : Node
        Of the master.
    structure : block_interface.Node
        Where the loop reads and writes.
    recorded : int
        Number of its recorded variables that the loop reads; 0 where it is frozen.
    """

    def __init__(self, node: Node, master: Master) -> None:
        self.node = node
        self.slave = node.subsystem if isinstance(node.subsystem, Slave) else None
        self._outputs = len(node.subsystem.outputs)
        self._samples = np.zeros((SAMPLES, 1 + 2 * self._outputs))
        self._sent = np.zeros_like(node.inputs)
        self._kept: list[Any] = []
        self.structure = c.Node(
            inputs=len(node.subsystem.inputs),
            outputs=self._outputs,
            needs_rates=node.needs_rates,
            varying=len(node.varying),
            varying_columns=self._indices(driven.column for driven in node.varying),
            polynomials=address(node.inputs),
            sent=address(self._sent),
            samples=address(self._samples),
        )
        number = {other: k for k, other in enumerate(master.nodes)}
        for name, links in (("upstream", node.moving_upstream), ("forward", node.forward), ("torn", node.torn)):
            groups = (c.Group * len(links))(*(self._group(link, number[link.source]) for link in links))
            self._kept.append(groups)
            setattr(self.structure, name, len(links))
            setattr(self.structure, f"{name}_group", groups)
        self.recorded = 0
        if self.slave is not None:
            self._connect(self.slave)

    def _connect(self, slave: Slave) -> None:
        references = slave.block_references()
        self._kept.append(references)
        structure = self.structure
        structure.input_references, structure.output_references, structure.recorded_references = references
        structure.recorded = self.recorded = len(references[2])
        structure.takes_polynomials = slave.takes_polynomials
        structure.component = slave.component
        for field, function in slave.block_functions.items():
            setattr(structure, field, function)

    def _group(self, link: Link, source: int) -> c.Group:
        outputs, inputs = list(_numbers(link.columns)), list(_numbers(link.targets))
        return c.Group(source, METHODS[link.method.name], len(outputs), self._indices(outputs), self._indices(inputs))

    def _indices(self, numbers: Iterable[int]) -> int:
        array = np.array(list(numbers), dtype=np.uintp)
        self._kept.append(array)
        return address(array)

    def is_ready(self) -> bool:
        """Return whether a block may begin with what the node has now."""
        if not self.node.samples or self.node.observer is not None:
            return False
        return self.slave is None or self.slave.is_ready_for_blocks()

    def load(self, master: Master) -> None:
        """Write what the master knows of the node."""
        self._known = len(self.node.samples)
        for row, (time, values, rates) in zip(self._samples[-self._known :], self.node.samples, strict=True):
            row[0] = time
            row[1 : 1 + self._outputs] = values
            if rates is not None:
                row[1 + self._outputs :] = rates
        self.structure.seconds, self.structure.restores = 0.0, 0
        if self.slave is None:
            return
        self._handle = master.start_handle(self.node)
        self.structure.state = ctypes.pointer(self._handle)
        self._said: dict[str, Warned] = {key: replace(one) for key, one in self.slave.log.warnings.items()}
        self.slave.lend(self.structure, self._sent)

    def store(self, done: int, end: float, failed: bool) -> None:
        """Read what the loop left after `done` steps, the last of which ended at `end` [s] for the FMU."""
        node = self.node
        node.seconds += self.structure.seconds
        node.restores += self.structure.restores
        if done:
            rated, m = node.needs_rates, self._outputs
            node.samples = tuple(
                Sample(float(row[0]), row[1 : 1 + m].copy(), row[1 + m :].copy() if rated else None)
                for row in self._samples[-(self._known + done) :]
            )
            node.current = node.samples[-1]
        if self.slave is None:
            return
        if failed:  # what it said then, it says again when the master takes the step
            self.slave.log.messages.clear()
            self.slave.log.warnings = self._said
        self.slave.take_back(self.structure, self._sent, self._handle, done, end, failed)


class ComponentMemory:
    """A component of the master for the loop, with the secants and past solutions of its unknowns."""

    def __init__(self, component: WiredComponent, master: Master) -> None:
        self.component = component
        interface = component.interface
        n = self.size = interface.size
        numbers = {node: k for k, node in enumerate(master.nodes)}
        self.structure = c.Component(numbers[component.nodes[0]], len(component.nodes))
        if not n:  # no loop, nothing to learn
            return
        self._columns, self._combined = np.zeros((n, 2 * n)), np.zeros((n, 2 * n))
        sources = [numbers[torn.node] for torn in interface.outputs]
        sizes = [torn.columns.size for torn in interface.outputs]
        outputs = [k for torn in interface.outputs for k in torn.columns.tolist()]
        self._arrays = [np.array(numbers, dtype=np.uintp) for numbers in (sources, sizes, outputs)]
        self._scale = np.array(interface.scale)
        self._times, self._solutions = np.zeros(KEPT), np.zeros((KEPT, n))
        self.structure = c.Component(
            numbers[component.nodes[0]],
            len(component.nodes),
            n,
            len(sources),
            *(address(array) for array in (*self._arrays, self._scale, self._columns, self._combined)),
            times=address(self._times),
            solutions=address(self._solutions),
        )

    def is_ready(self, master: Master) -> bool:
        """Return whether there are solutions enough to guess the next from."""
        return not self.size or len(master.history(self.component).solutions.times) >= LEAST

    def load(self, master: Master) -> None:
        """Write what was learned in earlier steps."""
        if not self.size:
            return
        history = master.history(self.component)
        secants, solutions = history.secants, history.solutions
        self.structure.solved = solved = len(solutions.times)
        if solved:
            self._times[:solved] = solutions.times
            self._solutions[:solved] = solutions.values
        self.structure.kept = kept = len(secants.columns)
        self._columns[:kept] = secants.columns if kept else 0.0
        self._combined[:] = 0.0
        self._combined[:kept] = secants.combined

    def store(self, master: Master) -> None:
        """Read what the loop left."""
        if not self.size:
            return
        history = master.history(self.component)
        secants, kept = history.secants, self.structure.kept
        solved = self.structure.solved
        history.solutions.times = self._times[:solved].tolist()
        history.solutions.values = list(self._solutions[:solved].copy())
        secants.columns = list(self._columns[:kept].copy())
        secants.combined = self._combined.copy()[:kept]


def _numbers(columns: Columns) -> Iterable[int]:
    return range(columns.start, columns.stop) if isinstance(columns, slice) else columns.tolist()
