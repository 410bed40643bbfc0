"""Consistent outputs and rates of a component at one time: at the start and after an event.

The unknowns are the torn outputs, and their rates where samples carry them. Outputs that are functions of the state
are consistent at once; those with feedthrough are iterated, whatever the method of the macro steps.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .acceleration import IterationHistory, create, solve
from .extrapolation import Sample
from .graph import WiredComponent
from .interface import InterfaceVector
from .node import Columns, Node
from .settings import Coupling
from .step_error import StepError, give_up

__all__ = ["initialize", "reinitialize_after_event"]

INSTANT = 1e-9  # [s] signals are evaluated this long after an event; jumps closer together than that are one


def initialize(component: WiredComponent, time: float, settings: Coupling) -> None:
    """Set consistent inputs and outputs in initialization mode, at `time` [s]. Raises CouplingError, SubsystemError."""

    def evaluate(node: Node) -> Sample:
        return Sample(time, node.subsystem.initialise(time, node.inputs[0]), None)

    _solve(component, time, evaluate, False, settings)


def reinitialize_after_event(component: WiredComponent, time: float, settings: Coupling) -> None:
    """Set consistent values and rates after inputs may have jumped; they become the only samples.

    Raises CouplingError, SubsystemError.
    """

    def evaluate(node: Node) -> Sample:
        node.subsystem.set_inputs(node.inputs)
        return node.sample(time)

    _solve(component, time, evaluate, True, settings)
    for node in component.nodes:
        node.samples = (node.current,)


def _solve(
    component: WiredComponent, time: float, evaluate: Callable[[Node], Sample], rates: bool, settings: Coupling
) -> None:
    for node in component.nodes:
        node.inputs[1:] = 0.0
        for column, signal in node.signals:
            node.inputs[: 2 if rates else 1, column] = signal.polynomial(time, INSTANT)[: 2 if rates else 1]
        for link in node.torn:
            if link.source.samples:
                _set_tangent(node, link.targets, link.columns, link.source.samples[-1])
        for link in node.upstream:
            _set_tangent(node, link.targets, link.columns, link.source.current)

    def sweep() -> None:
        for node in component.nodes:
            for link in node.forward:
                _set_tangent(node, link.targets, link.columns, link.source.current)
            node.current = evaluate(node)

    sweep()
    torn = component.interface.outputs
    if not torn:
        return
    interface = InterfaceVector(torn, [outputs.node.current.rates is not None for outputs in torn])

    def sweep_from(x: np.ndarray) -> np.ndarray:
        guesses = interface.unpack(x, lambda node: node.current, time, 1.0)
        for node in component.nodes:
            for link in node.torn:
                _set_tangent(node, link.targets, link.columns, guesses[link.source])
        sweep()
        return interface.pack(lambda node: node.current, 1.0)

    first = interface.pack(lambda node: node.current, 1.0)
    history = IterationHistory(interface.size)
    outcome = solve(sweep_from, first, interface.scale, create("iqn"), history, settings.tolerance, settings.max_sweeps)
    if not outcome.converged:
        cause = "the outputs of the loop at one instant do not converge"
        raise give_up(time, 0.0, StepError(cause, outcome.residuals, history.secants.gain))


def _set_tangent(node: Node, targets: Columns, columns: Columns, sample: Sample) -> None:
    """Set values of inputs, and their first derivatives where the sample has rates."""
    node.inputs[0, targets] = sample.values[columns]
    if sample.rates is not None:
        node.inputs[1, targets] = sample.rates[columns]
