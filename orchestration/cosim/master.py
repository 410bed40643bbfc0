"""The master: macro steps with rollback over subsystems behind one protocol.

A macro step saves every subsystem once, steps what lies before a loop once, and iterates each loop: restore, set
inputs as polynomials in time, step in Gauss-Seidel order, compare. How quantities travel (exchange), how a loop is
solved (iteration) and how long steps are (stepping) are independent choices, given as values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..errors import SubsystemError
from . import initialization
from .acceleration import IterationHistory
from .algebraic_loop import Settings, feed, solve_loop, step_node
from .extrapolation import Sample
from .graph import Circuit, Node
from .step_error import StepError, give_up

__all__ = ["Checkpoint", "Master", "Settings", "StepLog"]


class StepLog(NamedTuple):
    """What one accepted macro step was like. residual and error are shares of the nominals; inverse is the estimate
    of (I - S)^-1 of the last loop, whose gain is iteration.spectral_radius(inverse), None while nothing is known of
    it."""

    time: float  # end of the step [s]
    step: float  # [s]
    sweeps: int  # of the loop that took most
    residual: float  # the largest of all loops
    error: float  # estimated, the largest of all loops
    inverse: np.ndarray | None
    record: Any  # what the observer returned


@dataclass(eq=False)
class Checkpoint:
    """A place to come back to; its state handles are reused when saved again."""

    handles: dict[Node, Any]
    samples: dict[Node, tuple[Sample, ...]]


class Master:
    """circuits: from network.assemble; observe: called after every macro step, its result goes into the log."""

    def __init__(
        self, circuits: Sequence[Circuit], settings: Settings, observe: Callable[[], Any] = lambda: None
    ) -> None:
        self.circuits = tuple(circuits)
        self.nodes = tuple(node for circuit in circuits for node in circuit.nodes)
        self.settings = settings
        self.observe = observe
        self._traces = {circuit: IterationHistory(circuit.scale.size) for circuit in circuits}
        self._start = self.place()
        for circuit in circuits:
            rigid = [node.subsystem.name for node in circuit.nodes if not node.subsystem.can_rollback]
            if rigid and circuit.unknowns and settings.method is not None:
                raise SubsystemError(
                    f"{', '.join(rigid)} cannot save and restore state (canGetAndSetFMUstate = false), so the loop "
                    "cannot be iterated; export with it, or ask for explicit coupling with coupling.method = 'none'"
                )

    def initialise(self, time: float) -> None:
        """Consistent values at the start, end of initialisation. Raises CouplingError, SubsystemError."""
        for circuit in self.circuits:
            initialization.at_start(circuit, time, self.settings.tolerance, self.settings.max_sweeps)
        for node in self.nodes:
            node.subsystem.begin()
        self.arrive(time)

    def arrive(self, time: float) -> None:
        """Behind an event: forgets what was before. Raises CouplingError, SubsystemError."""
        for circuit in self.circuits:
            initialization.reinitialize_after_event(circuit, time, self.settings.tolerance, self.settings.max_sweeps)

    def advance(self, time: float, length: float) -> StepLog:
        """One coupled macro step [s]. Raises StepError with everything as it was."""
        self.save(self._start)
        sweeps, residual, error, inverse = 1, 0.0, 0.0, None
        try:
            for circuit in self.circuits:
                for node in circuit.nodes:
                    _signal(node, time, length)
                    feed(node, node.moving, time, self.settings.exchange)
                if not circuit.unknowns:
                    step_node(circuit.nodes[0], time, length, self.settings.exchange)
                    continue
                trace = self._traces[circuit]
                outcome = solve_loop(circuit, time, length, self.settings, trace, self._restore)
                sweeps = max(sweeps, len(outcome.residuals))
                residual = max(residual, outcome.residuals[-1])
                error = max(error, outcome.error)
                inverse = trace.secants.inverse
        except (SubsystemError, StepError) as failure:
            self._go_back(time, length, failure)
            self._traces[circuit] = IterationHistory(circuit.scale.size)  # what divergence taught misleads
            if isinstance(failure, StepError):
                raise
            raise StepError(str(failure), reached=failure.reached) from failure
        for node in self.nodes:
            node.samples = (*node.samples[-2:], node.now)
        return StepLog(time + length, length, sweeps, residual, error, inverse, self.observe())

    def outputs(self) -> np.ndarray:
        """All wired outputs at the present time, of all nodes in order."""
        return np.concatenate([node.samples[-1].values for node in self.nodes])

    def nominals(self) -> np.ndarray:
        """Of outputs(), in the same order."""
        return np.array([port.nominal for node in self.nodes for port in node.subsystem.outputs])

    def place(self) -> Checkpoint:
        return Checkpoint({}, {})

    def save(self, place: Checkpoint) -> None:
        for node in self.nodes:
            if node.subsystem.can_rollback:
                place.handles[node] = node.subsystem.save(place.handles.get(node))
            place.samples[node] = node.samples

    def rewind(self, place: Checkpoint) -> None:
        """Raises SubsystemError where a subsystem cannot go back."""
        for node in self.nodes:
            if node not in place.handles:
                raise SubsystemError(f"{node.subsystem.name} cannot be set back (canGetAndSetFMUstate = false)")
            node.subsystem.restore(place.handles[node])
            node.samples = place.samples[node]

    def restart(self, place: Checkpoint) -> None:
        """Back, as if nothing had been learned of the loops since. Raises SubsystemError as rewind."""
        self.rewind(place)
        self._traces = {circuit: IterationHistory(circuit.scale.size) for circuit in self.circuits}

    def release(self, place: Checkpoint) -> None:
        for node, handle in place.handles.items():
            node.subsystem.free(handle)
        place.handles.clear()

    def _restore(self, circuit: Circuit) -> None:
        for node in circuit.nodes:
            node.subsystem.restore(self._start.handles[node])

    def _go_back(self, time: float, length: float, failure: SubsystemError | StepError) -> None:
        """To the start of the step that failed. Raises CouplingError where a subsystem cannot go back."""
        try:
            self.rewind(self._start)
        except SubsystemError as stuck:
            over = str(stuck) in str(failure)  # nothing may be called any more
            cause = str(failure) if over else f"{failure}; {stuck}"
            remedy = "" if over else "Make coupling.macro_step smaller, or export with state saving and iterate"
            known = failure if isinstance(failure, StepError) else StepError(cause)
            raise give_up(time, length, StepError(cause, known.residuals, known.gain, remedy=remedy)) from failure


def _signal(node: Node, time: float, length: float) -> None:
    """Inputs that signals vary. What cannot be interpolated holds its end value, as with the exchange 'held'."""
    for column, signal in node.varying:
        c = signal.polynomial(time, length)
        if not node.subsystem.takes_polynomials:
            c = (c[0] + length * (c[1] + length * (c[2] / 2.0 + length * c[3] / 6.0)), 0.0, 0.0, 0.0)
        node.inputs[:, column] = c
