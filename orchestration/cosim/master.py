"""The master: macro steps with rollback over subsystems behind one protocol.

A macro step saves every subsystem once, steps components without a loop once, and iterates each loop: restore, set
inputs as polynomials in time, step in Gauss-Seidel order, compare. Polynomials (extrapolation), loop solvers
(acceleration) and lengths of steps (step_control) are independent choices.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ..errors import SubsystemError, TerminationRequest
from .acceleration import IterationHistory, PastSolutions
from .algebraic_loop import solve_loop
from .extrapolation import Sample, available
from .graph import WiredComponent
from .initialization import initialize, reinitialize_after_event
from .node import Link, MacroStep, Node, StepObserver
from .settings import Coupling
from .step_error import StepError, give_up

__all__ = ["Checkpoint", "Master", "StepLog"]


class StepLog(NamedTuple):
    """Log of an accepted macro step.

    Attributes
    ----------
    time : float
        End of the step [s].
    step : float
        Length [s].
    sweeps : int
        Sweeps of the loop that took most.
    residual, error : float
        Last residual and estimated error, the largest of all loops, as shares of the nominals.
    inverse : ndarray, shape (n, n), or None
        Estimate of (I - S)^-1 of the last loop, S = dG/dx of a sweep G; acceleration.spectral_radius(inverse) is the
        loop gain. None while nothing is known of it.
    record : Any
        What the observer returned.
    """

    time: float
    step: float
    sweeps: int
    residual: float
    error: float
    inverse: np.ndarray | None
    record: Any


@dataclass(eq=False)
class Checkpoint:
    """Saved states of all nodes. Saving again reuses the handles."""

    handles: dict[Node, Any]
    samples: dict[Node, tuple[Sample, ...]]


class Master:
    """Steps components of a coupling graph.

    Parameters
    ----------
    components : sequence of WiredComponent
        From graph.assemble.
    settings : Coupling
        Choices and tolerances.
    observe : callable
        Called after every macro step; its result is the record in the log.

    Attributes
    ----------
    rejected : int
        Steps taken back so far because they failed or were too inaccurate.
    seconds, recording_seconds : float
        Wall time of all steps, and of it that of `observe` [s].
    notes : list of str
        What the user should know of how the run was done.
    ended : str
        Which subsystem ended the simulation and why; "" where none did.

    Raises
    ------
    SubsystemError
        Where a loop is to be iterated and one of its subsystems cannot restore states.
    """

    def __init__(
        self, components: Sequence[WiredComponent], settings: Coupling, observe: Callable[[], Any] = lambda: None
    ) -> None:
        self.components = tuple(components)
        self.nodes = tuple(node for component in components for node in component.nodes)
        self.settings = settings
        self.observe = observe
        self.rejected = 0
        self.seconds = self.recording_seconds = 0.0
        self.notes: list[str] = []
        self.ended = ""
        self._forget_loops()
        self._start = self.checkpoint()
        self._require_rollback()

    def _require_rollback(self) -> None:
        """Raise SubsystemError where a loop is to be iterated and one of its subsystems cannot restore states."""
        for component in self.components:
            rigid = [node.subsystem.name for node in component.nodes if not node.subsystem.can_rollback]
            if rigid and component.interface.size and self.settings.loop_method is not None:
                raise SubsystemError(
                    f"{', '.join(rigid)} cannot save and restore state (canGetAndSetFMUstate = false), so the loop "
                    "cannot be iterated; export with it, or ask for explicit coupling with coupling.method = 'none'"
                )

    def initialise(self, time: float) -> None:
        """Set consistent values at the start [s] and end initialization. Raises CouplingError, SubsystemError."""
        for component in self.components:
            initialize(component, time, self.settings)
        for node in self.nodes:
            node.subsystem.begin()
        self._require_rollback()  # begin() may find that states cannot be saved as promised
        self._limit_polynomials()
        self.arrive(time)

    def _limit_polynomials(self) -> None:
        """Describe inputs by what their subsystems take and their sources offer, and note what that changes."""
        for node in self.nodes:
            links = [link for link in node.upstream + node.forward + node.torn if not link.held]
            signals = [driven.signal.degree for driven in node.varying]
            wanted = max([link.method.order - 1 for link in links] + signals, default=0)
            accepted = node.subsystem.accepted_input_order(wanted) if node.degree and wanted else 0
            if accepted < wanted:
                node.degree = accepted
            changed = set()
            for link in links:
                asked = self.settings.torn if link in node.torn else self.settings.forward
                has_rates = link.source.subsystem.has_rates
                link.method = available(asked, node.degree, has_rates)
                if asked.needs_derivatives and not has_rates and node.degree > 1:
                    self._note(f"{link.source.subsystem.name} offers no output derivatives")
                if link.method is not asked:
                    changed.add(link.method.name)
            if node.degree < max([wanted, *(self._asked_degree(link, node) for link in links)], default=0):
                taken = f"up to order {node.degree}" if node.degree else "no"
                self._note(f"{node.subsystem.name} takes {taken} input derivatives")
            if changed:
                self._note(f"inputs of {node.subsystem.name} are described as {', '.join(sorted(changed))}")

    def _asked_degree(self, link: Link, node: Node) -> int:
        return (self.settings.torn if link in node.torn else self.settings.forward).order - 1

    def _note(self, text: str) -> None:
        if text not in self.notes:
            self.notes.append(text)

    def arrive(self, time: float) -> None:
        """Reinitialize after an event at `time` [s]; earlier samples are discarded.

        Raises CouplingError, SubsystemError.
        """
        for component in self.components:
            self._histories[component].solutions = PastSolutions()  # a polynomial does not continue across an event
            reinitialize_after_event(component, time, self.settings)

    def advance(self, step: MacroStep) -> StepLog:
        """Take a coupled macro step.

        Raises StepError with everything as it was before, CouplingError where a subsystem cannot be set back.
        """
        begin = perf_counter()
        try:
            log = self._advance(step)
            observed = perf_counter()
            log = log._replace(record=self.observe())
            self.recording_seconds += perf_counter() - observed
            return log
        finally:
            self.seconds += perf_counter() - begin

    def _advance(self, step: MacroStep) -> StepLog:
        time, length, end = step
        self.save(self._start)
        sweeps, residual, error, inverse = 1, 0.0, 0.0, None
        try:
            for component in self.components:
                for node in component.nodes:
                    node.apply_signals(time, length)
                    node.receive(node.moving_upstream, time)
                if not component.interface.size:
                    for node in component.nodes:  # several where discrete values alone close a loop
                        node.step(step)
                    continue
                history = self._histories[component]
                outcome = solve_loop(component, step, self.settings, history, self._restore)
                sweeps = max(sweeps, len(outcome.residuals))
                residual = max(residual, outcome.residuals[-1])
                error = max(error, outcome.error)
                inverse = history.secants.inverse
        except (SubsystemError, StepError) as failure:
            self.rejected += 1
            termination = isinstance(failure, TerminationRequest)
            if isinstance(failure, TerminationRequest) and not all(n.subsystem.can_rollback for n in self.nodes):
                raise self._ended_part_way(step, failure) from failure
            self._go_back(time, length, failure)
            self._histories[component].forget()  # the secants come from diverging iterates
            if isinstance(failure, StepError):
                raise
            raise StepError(str(failure), reached=failure.reached, termination=termination) from failure
        for node in self.nodes:
            node.samples = (*node.samples[-2:], node.current)
        return StepLog(end, length, sweeps, residual, error, inverse, None)

    def _ended_part_way(self, step: MacroStep, request: TerminationRequest) -> StepError:
        """Return the error of a step in which an FMU ended the simulation and that cannot be taken back.

        What one subsystem alone did until then is a step of its own. Several lie at different times by now, so the
        run ends where the step began.
        """
        reached, log = step.time, None
        [*others, node] = self.nodes
        if not others and request.reached > step.time:
            reached = request.reached
            node.current = node.sample(reached)
            node.samples = (*node.samples[-2:], node.current)
            log = StepLog(reached, reached - step.time, 1, 0.0, 0.0, None, self.observe())
        return StepError(str(request), reached=reached, termination=True, log=log)

    def watch(self, name: str, observer: StepObserver | None) -> None:
        """Let an observer follow the steps and restores of the subsystem of that name; None ends it."""
        next(node for node in self.nodes if node.subsystem.name == name).observer = observer

    def outputs(self) -> np.ndarray:
        """Return all wired outputs now (n,), node by node."""
        return np.concatenate([node.samples[-1].values for node in self.nodes])

    def nominals(self) -> np.ndarray:
        """Return the nominals (n,) of outputs()."""
        return np.array([port.nominal for node in self.nodes for port in node.subsystem.outputs])

    def checkpoint(self) -> Checkpoint:
        """Return an empty checkpoint, to be filled by save()."""
        return Checkpoint({}, {})

    def save(self, checkpoint: Checkpoint) -> None:
        """Save all states. Raises SubsystemError."""
        for node in self.nodes:
            if node.subsystem.can_rollback:
                checkpoint.handles[node] = node.save(checkpoint.handles.get(node))
            checkpoint.samples[node] = node.samples

    def rewind(self, checkpoint: Checkpoint) -> None:
        """Restore all states. Raises SubsystemError where a subsystem cannot be set back."""
        for node in self.nodes:
            if node not in checkpoint.handles:
                raise SubsystemError(f"{node.subsystem.name} cannot be set back (canGetAndSetFMUstate = false)")
            node.restore(checkpoint.handles[node])
            node.samples = checkpoint.samples[node]

    def restart(self, checkpoint: Checkpoint) -> None:
        """Restore all states and discard what was learned of the loops. Raises SubsystemError as rewind()."""
        self.rewind(checkpoint)
        self._forget_loops()

    def release(self, checkpoint: Checkpoint) -> None:
        """Free all handles of a checkpoint."""
        for node, handle in checkpoint.handles.items():
            node.subsystem.free(handle)
        checkpoint.handles.clear()

    def start_handle(self, node: Node) -> Any:
        """Return the handle that the start of the next step is saved in, for those who take steps in its place."""
        if node not in self._start.handles:
            self._start.handles[node] = node.save()
        return self._start.handles[node]

    def history(self, component: WiredComponent) -> IterationHistory:
        """Return what was learned of a component's loop."""
        return self._histories[component]

    def _forget_loops(self) -> None:
        self._histories = {component: IterationHistory(component.interface.size) for component in self.components}

    def _restore(self, component: WiredComponent) -> None:
        for node in component.nodes:
            node.restore(self._start.handles[node])

    def _go_back(self, time: float, length: float, failure: SubsystemError | StepError) -> None:
        """Restore the start of the failed step. Raises CouplingError where a subsystem cannot be set back."""
        try:
            self.rewind(self._start)
        except SubsystemError as stuck:
            # After a fatal error a subsystem answers every call with that error, so it is said once, without a remedy.
            cause = str(stuck) if stuck.fatal else f"{failure}; {stuck}"
            remedy = "" if stuck.fatal else "Make coupling.macro_step smaller, or export with state saving and iterate"
            residuals, gain = (
                (failure.residuals, failure.gain) if isinstance(failure, StepError) else ((), float("nan"))
            )
            raise give_up(
                time, length, StepError(cause, residuals, gain, remedy=remedy), self.settings.method
            ) from failure
