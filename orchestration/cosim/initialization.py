"""Consistent outputs and rates of a loop at one instant: at the start and behind an event, where no step has linked
them.

The unknowns are the torn outputs, and their rates where wanted. Outputs that are functions of state are consistent at
once; those with feedthrough are iterated, whatever the method of the macro steps (IQN: an instant has no history that
could matter)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .acceleration import METHODS, IterationHistory, solve
from .extrapolation import Sample
from .graph import Circuit, Columns, Node
from .step_error import StepError, give_up

__all__ = ["at_start", "reinitialize_after_event"]

INSTANT = 1e-9  # [s] the side of an instant that counts is the later one


def at_start(circuit: Circuit, time: float, tolerance: float, max_sweeps: int) -> None:
    """Input and output values in initialisation mode. Raises CouplingError, SubsystemError."""

    def visit(node: Node) -> Sample:
        return Sample(time, node.subsystem.initialise(time, node.inputs[0]), None)

    _settle(circuit, time, visit, False, tolerance, max_sweeps)


def reinitialize_after_event(circuit: Circuit, time: float, tolerance: float, max_sweeps: int) -> None:
    """Values and rates of the outputs at the start of a step whose signals may have jumped; they become the only
    samples."""

    def visit(node: Node) -> Sample:
        node.subsystem.set_inputs(node.inputs)
        return node.sample(time)

    _settle(circuit, time, visit, True, tolerance, max_sweeps)
    for node in circuit.nodes:
        node.samples = (node.now,)


def _settle(
    circuit: Circuit, time: float, visit: Callable[[Node], Sample], rates: bool, tolerance: float, max_sweeps: int
) -> None:
    for node in circuit.nodes:
        node.inputs[1:] = 0.0
        for column, signal in node.signals:
            node.inputs[: 2 if rates else 1, column] = signal.polynomial(time, INSTANT)[: 2 if rates else 1]
        for link in node.torn:
            if link.source.samples:
                _feed(node, link.targets, link.columns, link.source.samples[-1])
        for link in node.given:
            _feed(node, link.targets, link.columns, link.source.now)

    def sweep() -> None:
        for node in circuit.nodes:
            for link in node.forward:
                _feed(node, link.targets, link.columns, link.source.now)
            node.now = visit(node)

    def around(x: np.ndarray) -> np.ndarray:
        guess = _spread(circuit, x)
        for node in circuit.nodes:
            for link in node.torn:
                _feed(node, link.targets, link.columns, guess[link.source])
        sweep()
        return _gather(circuit)

    sweep()
    if not circuit.unknowns:
        return
    first = _gather(circuit)
    scale = np.concatenate([np.tile(scale, 1 if node.now.rates is None else 2) for node, _, scale in circuit.unknowns])
    trace = IterationHistory(first.size)
    outcome = solve(around, first, scale, METHODS["iqn"](), trace, tolerance, max_sweeps)
    if not outcome.converged:
        cause = "the outputs of the loop at one instant do not converge"
        raise give_up(time, 0.0, StepError(cause, outcome.residuals, trace.secants.gain))


def _feed(node: Node, targets: Columns, columns: Columns, sample: Sample) -> None:
    node.inputs[0, targets] = sample.values[columns]
    if sample.rates is not None:
        node.inputs[1, targets] = sample.rates[columns]


def _gather(circuit: Circuit) -> np.ndarray:
    parts = []
    for node, columns, _ in circuit.unknowns:
        parts.append(node.now.values[columns])
        if node.now.rates is not None:
            parts.append(node.now.rates[columns])
    return np.concatenate(parts)


def _spread(circuit: Circuit, x: np.ndarray) -> dict[Node, Sample]:
    """The samples of the torn sources with the unknowns in their places."""
    guess, place = {}, 0
    for node, columns, _ in circuit.unknowns:
        n = columns.size
        values = node.now.values.copy()
        values[columns] = x[place : place + n]
        place += n
        rates = None
        if node.now.rates is not None:
            rates = node.now.rates.copy()
            rates[columns] = x[place : place + n]
            place += n
        guess[node] = Sample(node.now.time, values, rates)
    return guess
