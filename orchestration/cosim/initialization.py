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
from .node import Link, Node
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
            rows = 2 if rates and not node.subsystem.inputs[column].discrete else 1
            node.inputs[:rows, column] = signal.polynomial(time, INSTANT)[:rows]
        for link in node.torn + node.delayed:
            if link.source.samples:
                _set_tangent(node, link, link.source.samples[-1])
        for link in node.upstream:
            _set_tangent(node, link, link.source.current)

    def sweep() -> None:
        for node in component.nodes:
            for link in node.forward:
                _set_tangent(node, link, link.source.current)
            node.current = evaluate(node)

    sweep()
    for _ in range(settings.max_sweeps if any(node.delayed for node in component.nodes) else 0):
        before = [node.inputs[0].copy() for node in component.nodes]
        for node in component.nodes:
            for link in node.delayed:
                _set_tangent(node, link, link.source.current)
        if all(np.array_equal(a, node.inputs[0]) for a, node in zip(before, component.nodes, strict=True)):
            break
        sweep()
    torn = component.interface.outputs
    if not torn:
        return
    interface = InterfaceVector(torn, [outputs.node.current.rates is not None for outputs in torn])

    def sweep_from(x: np.ndarray) -> np.ndarray:
        guesses = interface.unpack(x, lambda node: node.current, time, 1.0)
        for node in component.nodes:
            for link in node.torn:
                _set_tangent(node, link, guesses[link.source])
        sweep()
        return interface.pack(lambda node: node.current, 1.0)

    first = interface.pack(lambda node: node.current, 1.0)
    interface.adapt(first)
    history = IterationHistory(interface.size)
    outcome = solve(sweep_from, first, interface.scale, create("iqn"), history, settings.tolerance, settings.max_sweeps)
    if not outcome.converged:
        cause = "the outputs of the loop at one instant do not converge"
        raise give_up(time, 0.0, StepError(cause, outcome.residuals, history.secants.gain), "iqn")


def _set_tangent(node: Node, link: Link, sample: Sample) -> None:
    """Set values of inputs, and their first derivatives where the sample has rates."""
    node.inputs[0, link.targets] = sample.values[link.columns]
    if sample.rates is not None and not link.held:
        node.inputs[1, link.targets] = sample.rates[link.columns]
