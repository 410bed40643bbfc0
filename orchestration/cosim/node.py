"""A subsystem in the coupling graph: wiring as index arrays, input polynomials and samples of the outputs."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, NamedTuple, Protocol

import numpy as np

from .extrapolation import NOTHING, Extrapolation, Sample, reduce_degree
from .signals import Signal
from .subsystem import Subsystem

__all__ = ["Columns", "DrivenInput", "Link", "MacroStep", "Node", "StepObserver"]

Columns = np.ndarray | slice  # a slice where indices are consecutive, which numpy copies several times faster


class MacroStep(NamedTuple):
    """One macro step.

    Attributes
    ----------
    time : float
        Its start [s].
    length : float
        What subsystems are asked to advance by [s].
    end : float
        Its end [s]: time + length but for rounding.
    """

    time: float
    length: float
    end: float


class DrivenInput(NamedTuple):
    """An input column of a node and the signal that drives it."""

    column: int
    signal: Signal


class StepObserver(Protocol):
    """Hooks for measurements on one subsystem."""

    def stepped(self) -> None:
        """Follow a step of the subsystem; its outputs are those of the end of the step."""

    def restored(self) -> None:
        """Follow a restored state."""


@dataclass(eq=False)
class Link:
    """All connections of one kind from one source to one target.

    Attributes
    ----------
    source : Node
        Where the values come from.
    columns : Columns
        Indices of the source's outputs.
    targets : Columns
        Indices of the target's inputs.
    method : Extrapolation
        Polynomials of these inputs.
    held : bool
        Whether the values are discrete at either end: held over a step instead of interpolated.
    """

    source: Node
    columns: Columns
    targets: Columns
    method: Extrapolation
    held: bool = False


@dataclass(eq=False)
class Node:
    """A subsystem with n_u inputs, as a node of the graph.

    Attributes
    ----------
    subsystem : Subsystem
        What is stepped.
    signals, varying : tuple of DrivenInput
        Inputs driven by signals; those of them that are not constant.
    inputs : ndarray, shape (4, n_u)
        Polynomials of the inputs for the next step; constants stay in it from the start on.
    upstream : list of Link
        Into this node from components that are stepped before its own; `moving_upstream` those whose source is not
        frozen.
    forward : list of Link
        Into this node from nodes before it in the same sweep.
    torn : list of Link
        Into this node, with guessed or extrapolated end values.
    delayed : list of Link
        Into this node, discrete values that would close a loop: those of the start of a step hold over it.
    degree : int
        Highest degree of input polynomials that the subsystem takes.
    needs_rates : bool
        Whether samples carry time derivatives.
    samples : tuple of Sample
        At most the three newest, from old to new; cut at events.
    current : Sample
        End of the step in progress.
    observer : StepObserver or None
        Receives steps and restores, for measurements.
    seconds : float
        Wall time spent in the subsystem so far: inputs, steps, outputs, saved and restored states [s].
    restores : int
        Number of restored states.
    """

    subsystem: Subsystem
    signals: tuple[DrivenInput, ...]
    varying: tuple[DrivenInput, ...]
    inputs: np.ndarray
    upstream: list[Link] = field(default_factory=list)
    moving_upstream: list[Link] = field(default_factory=list)
    forward: list[Link] = field(default_factory=list)
    torn: list[Link] = field(default_factory=list)
    delayed: list[Link] = field(default_factory=list)
    degree: int = 3
    needs_rates: bool = False
    samples: tuple[Sample, ...] = ()
    current: Sample = NOTHING
    observer: StepObserver | None = None
    seconds: float = 0.0
    restores: int = 0

    def sample(self, time: float) -> Sample:
        """Return the wired outputs now, at `time` [s]. Raises SubsystemError."""
        return Sample(time, self.subsystem.values(), self.subsystem.rates() if self.needs_rates else None)

    def apply_signals(self, time: float, length: float) -> None:
        """Set inputs that signals vary, and discrete ones from inside a loop.

        A discrete input holds the value at the start.
        """
        for link in self.delayed:
            self.inputs[:, link.targets] = 0.0
            self.inputs[0, link.targets] = link.source.samples[-1].values[link.columns]
        for driven in self.varying:
            self.inputs[:, driven.column] = self.driven_polynomial(driven, time, length)

    def driven_polynomial(self, driven: DrivenInput, time: float, length: float) -> tuple[float, float, float, float]:
        """Return the polynomial of an input over a step from `time` of `length` [s], as the subsystem takes it."""
        c = driven.signal.polynomial(time, length)
        if self.subsystem.inputs[driven.column].discrete:
            return (c[0], 0.0, 0.0, 0.0)
        return reduce_degree(c, length, self.degree) if self.degree < driven.signal.degree else c

    def receive(self, links: list[Link], time: float) -> None:
        """Set inputs whose sources have done the step from `time` [s] already."""
        for link in links:
            source = link.source
            if link.held:
                self.inputs[:, link.targets] = 0.0
                self.inputs[0, link.targets] = source.current.values[link.columns]
                continue
            self.inputs[:, link.targets] = link.method.fit((*source.samples, source.current), time)[:, link.columns]

    def step(self, step: MacroStep) -> None:
        """Set forward inputs and advance the subsystem; all other inputs are set already. Raises SubsystemError."""
        self.receive(self.forward, step.time)
        begin = perf_counter()
        try:
            self.subsystem.set_inputs(self.inputs)
            self.subsystem.step(step.time, step.length)
            self.current = self.sample(step.end)
        finally:
            self.seconds += perf_counter() - begin
        if self.observer is not None:
            self.observer.stepped()

    def save(self, into: Any = None) -> Any:
        """Return a handle of the subsystem's state; `into` is an older one that may be overwritten."""
        begin = perf_counter()
        state = self.subsystem.save(into)
        self.seconds += perf_counter() - begin
        return state

    def restore(self, state: Any) -> None:
        """Set the subsystem back to a saved state. Raises SubsystemError."""
        begin = perf_counter()
        self.subsystem.restore(state)
        self.seconds += perf_counter() - begin
        self.restores += 1
        if self.observer is not None:
            self.observer.restored()
