"""One loop over one macro step: guess the end values of torn outputs, sweep, compare, until the error is small.

For displacement and force of the TCAs this is the closure of Eqs. 18-20 (docs/theory/coupling.md).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ..errors import SubsystemError, TerminationRequest
from .acceleration import IterationHistory, Method, Outcome, create, norm, solve
from .extrapolation import METHODS, Extrapolation, Sample
from .graph import WiredComponent
from .node import MacroStep, Node
from .settings import Coupling
from .step_error import StepError

__all__ = ["solve_loop"]

LIMIT_REMEDY = (
    "Raise coupling.reach, give the FMU's variable a nominal of its size, or make coupling.macro_step smaller"
)
FOLLOWED = 0.5  # largest error of an extrapolation that follows a value, as a share of it
MAX_FITS = 4  # iterations of one step while undeclared nominals are fitted: to the first sweep, then to the solution


class _NominalsChanged(Exception):  # noqa: N818 - no error
    """Undeclared nominals were fitted to the first sweep, so the iteration begins anew with them."""


def solve_loop(
    component: WiredComponent,
    step: MacroStep,
    settings: Coupling,
    history: IterationHistory,
    restore: Callable[[WiredComponent], None],
) -> Outcome:
    """Step the nodes of a loop with consistent inputs.

    Parameters
    ----------
    component : WiredComponent
        Its nodes are at the start of the step; inputs from signals and other components are set.
    step : MacroStep
        What is to be done.
    settings : Coupling
        Method, tolerance and limits.
    history : IterationHistory
        What earlier steps left.
    restore : callable
        Sets the component's nodes back to the start of the step.

    Raises
    ------
    StepError
        With the residuals, the estimated gain, and the time reached by a subsystem that refused the step.
    """
    interface = component.interface
    method = settings.loop_method or _first_step_method(component, settings.torn)
    if method is None:
        return _explicit(component, step, settings)
    start = interface.pack(lambda node: node.samples[-1], step.length)
    if interface.adapt(start):
        history.forget()
    solutions = history.solutions
    solutions.begin_step(step.time, start)
    guess = _first_guess(component, step, settings, history)
    if interface.fits_nominals:  # nominals that only follow from the past do not bound the future
        far = interface.adaptive & (np.abs(guess - start) > settings.trust_radius * interface.scale)
        guess[far] = start[far]
    fresh = True

    def sweep_from(x: np.ndarray) -> np.ndarray:
        nonlocal fresh
        distances = (x - start) / interface.scale
        if not norm(distances) <= settings.trust_radius:
            raise StepError(_limit_text(component, x, start, settings.trust_radius), remedy=LIMIT_REMEDY)
        if not fresh:
            restore(component)
        fresh = False
        guesses = interface.unpack(x, lambda node: node.samples[-1], step.end, step.length)
        _set_torn_inputs(component, step.time, guesses)
        swept = _sweep(component, step)
        if not history.r and interface.adapt_provisionally(swept):
            raise _NominalsChanged
        return swept

    def iterate(guess: np.ndarray) -> Outcome:
        return solve(
            sweep_from,
            guess,
            interface.scale,
            method,
            history,
            settings.tolerance,
            settings.max_sweeps,
            jacobian=lambda: None if settings.torn.needs_derivatives else _jacobian(component),
        )

    cause, reached, remedy = "the iteration does not converge", None, ""
    try:
        for _ in range(MAX_FITS):
            try:
                outcome = iterate(guess)
            except _NominalsChanged:
                history.forget()
                continue
            if not outcome.converged or not interface.adapt(outcome.x):
                break
            history.forget()
            guess = outcome.x
        if outcome.converged:
            solutions.add(step.end, outcome.solution)
            return outcome
    except StepError as failure:
        cause, remedy = failure.cause, failure.remedy
    except TerminationRequest:
        raise
    except SubsystemError as failure:
        cause, reached = str(failure), failure.reached
    except np.linalg.LinAlgError:
        cause = "the estimated Jacobian of the loop is singular"
    residuals = tuple(norm(r) for r in history.r)
    if len(residuals) > 1 and residuals[-1] > residuals[0]:
        cause = f"the iteration diverges ({cause})"
    raise StepError(cause, residuals, history.secants.gain, reached, remedy)


def _first_guess(
    component: WiredComponent, step: MacroStep, settings: Coupling, history: IterationHistory
) -> np.ndarray:
    """Return the unknowns (n,) at the end of the step, from earlier solutions or, where these are few, from samples."""
    interface = component.interface
    if settings.loop_method is None:  # a first step starts from its own waveform
        return interface.predict(settings.torn.fit, step.time, step.length)
    guess = None if interface.with_rates else history.solutions.guess(step.end, interface.scale)
    return interface.predict(METHODS["quadratic"].fit, step.time, step.length) if guess is None else guess


def _explicit(component: WiredComponent, step: MacroStep, settings: Coupling) -> Outcome:
    """Sweep once with extrapolated inputs. The residual is the error of the extrapolation."""
    interface = component.interface
    x = interface.predict(settings.torn.fit, step.time, step.length)
    _set_torn_inputs(component, step.time, {})
    swept = _sweep(component, step)
    # An undeclared nominal is 1, as FMI has it, until values grow in a way that extrapolation follows: what an unstable
    # coupling blows up must not be the measure of its own error.
    scale = np.where(interface.adaptive, np.maximum(interface.scale, 1.0), interface.scale)
    error = norm((swept - x) / scale)
    if not error <= settings.trust_radius:
        cause = f"explicit coupling is off by more than the reach of {settings.trust_radius:g} nominals"
        cause += f", most in {_farthest(component, swept, x)}"
        raise StepError(cause, (error,), remedy="Iterate: coupling.method = 'iqn', or take smaller macro steps")
    if interface.fits_nominals and (np.abs(swept - x) <= FOLLOWED * np.abs(swept))[interface.adaptive].all():
        interface.adapt(swept)
    return Outcome(x, True, error, (error,), x)


def _first_step_method(component: WiredComponent, waveform: Extrapolation) -> Method | None:
    """Return a method for an explicit step that extrapolation is too poor for.

    Cubics need two samples. After the start or an event there is one, whose tangent is an order less accurate than a
    first step has to be, so that step is iterated where states can be restored.
    """
    nodes = [torn.node for torn in component.interface.outputs]
    short = waveform.needs_derivatives and any(len(node.samples) < 2 for node in nodes)
    return create("iqn") if short and all(node.subsystem.can_rollback for node in component.nodes) else None


def _limit_text(component: WiredComponent, x: np.ndarray, start: np.ndarray, radius: float) -> str:
    return (
        f"the iteration went further than the reach of {radius:g} nominals (coupling.reach), most in "
        f"{_farthest(component, x, start)}"
    )


def _farthest(component: WiredComponent, x: np.ndarray, base: np.ndarray) -> str:
    """Name the unknown that lies farthest from its base, in nominals, with both values."""
    interface = component.interface
    distances = np.abs(x - base) / interface.scale
    k = int(np.argmax(np.where(np.isnan(distances), np.inf, distances)))
    return f"{interface.name(k)}: {x[k]:.4g} from {base[k]:.4g}, nominal {interface.scale[k]:.3g}"


def _sweep(component: WiredComponent, step: MacroStep) -> np.ndarray:
    """Step every node once and return the unknowns (n,) that result."""
    for node in component.nodes:
        node.step(step)
    return component.interface.pack(lambda node: node.current, step.length)


def _set_torn_inputs(component: WiredComponent, time: float, guesses: Mapping[Node, Sample]) -> None:
    """Set torn inputs to polynomials through the guessed end values, or through past samples alone."""
    polynomials: dict[tuple[Node, str], np.ndarray] = {}
    for node in component.nodes:
        for link in node.torn:
            key = (link.source, link.method.name)
            if key not in polynomials:
                past = link.source.samples
                samples = (*past, guesses[link.source]) if guesses else past
                polynomials[key] = link.method.fit(samples, time)
            node.inputs[:, link.targets] = polynomials[key][:, link.columns]


def _jacobian(component: WiredComponent) -> np.ndarray | None:
    """Return the derivatives (n, n) of the residual by the unknowns, in nominals.

    By the chain rule along the last sweep; None where a subsystem offers no directional derivatives.
    """
    interface = component.interface
    guessed, swept = interface.seeds(), dict[Node, np.ndarray]()
    for node in component.nodes:
        links = [(link, guessed) for link in node.torn] + [(link, swept) for link in node.forward]
        tangent = node.subsystem.tangent(np.r_[tuple(link.targets for link, _ in links)])
        if tangent is None:
            return None
        swept[node] = tangent @ np.concatenate([source[link.source][link.columns] for link, source in links])
    through = np.concatenate([swept[torn.node][torn.columns] for torn in interface.outputs])
    return (through * interface.scale - np.diag(interface.scale)) / interface.scale[:, None]
