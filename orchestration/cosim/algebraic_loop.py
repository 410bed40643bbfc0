"""One loop over one macro step: guess the end values of what is torn, sweep, compare, until the estimated error is
small. For displacement and force of the TCAs this is the closure of Eqs. 18-20 (docs/theory/coupling.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import SubsystemError
from .acceleration import METHODS as ITERATIONS
from .acceleration import IterationHistory, Method, Outcome, norm, solve
from .extrapolation import METHODS, Exchange, Sample, powers
from .graph import Circuit, Link, Node
from .step_error import StepError

__all__ = ["Settings", "feed", "solve_loop", "step_node"]


@dataclass(frozen=True)
class Settings:
    """method None: explicit coupling, one sweep. tolerance: of the coupling error, share of the nominals."""

    exchange: Exchange
    waveform: Exchange
    method: Method | None
    tolerance: float = 1e-6
    max_sweeps: int = 30
    halvings: int = 6
    reach: float = 10.0  # how far a guess may go from the start of a step, in nominals: beyond, subsystems only suffer


def feed(node: Node, links: list[Link], time: float, exchange: Exchange) -> None:
    """Inputs whose sources have done the step already."""
    for link in links:
        source = link.source
        node.inputs[:, link.targets] = exchange.fit((*source.samples, source.now), time)[:, link.columns]


def step_node(node: Node, time: float, length: float, exchange: Exchange) -> None:
    """Forward inputs, then the subsystem's own step; torn and external inputs are set already. Raises
    SubsystemError."""
    feed(node, node.forward, time, exchange)
    node.subsystem.set_inputs(node.inputs)
    node.subsystem.step(time, length)
    node.now = node.sample(time + length)


def solve_loop(
    circuit: Circuit,
    time: float,
    length: float,
    settings: Settings,
    trace: IterationHistory,
    restore: Callable[[Circuit], None],
) -> Outcome:
    """The loop's nodes are at `time`; restore sets them back there. Raises StepError with the residuals and gain
    found."""
    x = _predict(circuit, time, length, settings)
    method = settings.method or _starter(circuit, settings.waveform)
    if method is None:
        _tear(circuit, time, settings.waveform, {})
        residual = (_sweep(circuit, time, length, settings) - x) / circuit.scale
        off = norm(residual)
        if not off <= settings.reach:
            cause = f"explicit coupling is off by more than the reach of {settings.reach:g} nominals"
            raise StepError(cause, (off,), remedy="Iterate: coupling.method = 'iqn', or take smaller macro steps")
        return Outcome(x, True, off, (off,))
    fresh, start = True, _gather(circuit, length, settings.waveform, lambda node: node.samples[-1])

    def around(x: np.ndarray) -> np.ndarray:
        nonlocal fresh
        if not norm((x - start) / circuit.scale) <= settings.reach:
            raise StepError(f"the iteration went further than the reach of {settings.reach:g} nominals")
        if not fresh:
            restore(circuit)
        fresh = False
        _tear(circuit, time, settings.waveform, _ends(circuit, x, time, length, settings.waveform))
        return _sweep(circuit, time, length, settings)

    cause, reached = "the iteration does not converge", None
    trace.tangent = lambda: None if settings.waveform.slopes else _tangent(circuit)
    try:
        outcome = solve(around, x, circuit.scale, method, trace, settings.tolerance, settings.max_sweeps)
        if outcome.converged:
            return outcome
    except StepError as failure:
        cause = failure.cause
    except SubsystemError as failure:
        cause, reached = str(failure), failure.reached
    except np.linalg.LinAlgError:
        cause = "the estimated Jacobian of the loop is singular"
    residuals = tuple(norm(r) for r in trace.r)
    if len(residuals) > 1 and residuals[-1] > residuals[0]:
        cause = f"the iteration diverges ({cause})"
    raise StepError(cause, residuals, trace.secants.gain, reached)


def _starter(circuit: Circuit, waveform: Exchange) -> Method | None:
    """Explicit cubics need two samples. Behind a start or an event there is one, whose tangent is an order short of
    what a first step may lose, so that step is iterated where states can be set back."""
    short = waveform.slopes and any(len(node.samples) < 2 for node, *_ in circuit.unknowns)
    return ITERATIONS["iqn"]() if short and all(node.subsystem.can_rollback for node in circuit.nodes) else None


def _sweep(circuit: Circuit, time: float, length: float, settings: Settings) -> np.ndarray:
    """Steps every node once; returns what the unknowns became."""
    for node in circuit.nodes:
        step_node(node, time, length, settings.exchange)
    return _gather(circuit, length, settings.waveform, lambda node: node.now)


def _gather(circuit: Circuit, length: float, waveform: Exchange, sample: Callable[[Node], Sample]) -> np.ndarray:
    """The unknowns (n,) in the samples of their nodes: values, and slopes times length where a waveform has them."""
    parts = []
    for node, columns, _ in circuit.unknowns:
        _, values, rates = sample(node)
        parts.append(values[columns])
        if waveform.slopes and rates is not None:  # always together: network.assemble asks for them
            parts.append(length * rates[columns])
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _tangent(circuit: Circuit) -> np.ndarray | None:
    """Derivatives (n, n) of the residual by the unknowns, in nominals, by the chain rule along the sweep just done;
    None where a subsystem offers none."""
    size = circuit.scale.size
    guess, moved, place = dict[Node, np.ndarray](), dict[Node, np.ndarray](), 0
    for node, columns, _ in circuit.unknowns:
        guess[node] = np.zeros((len(node.subsystem.outputs), size))
        guess[node][columns, place + np.arange(columns.size)] = 1.0
        place += columns.size
    for node in circuit.nodes:
        links = [(link, guess) for link in node.torn] + [(link, moved) for link in node.forward]
        tangent = node.subsystem.tangent(np.r_[tuple(link.targets for link, _ in links)])
        if tangent is None:
            return None
        moved[node] = tangent @ np.concatenate([source[link.source][link.columns] for link, source in links])
    through = np.concatenate([moved[node][columns] for node, columns, _ in circuit.unknowns])
    return (through * circuit.scale - np.diag(circuit.scale)) / circuit.scale[:, None]


def _tear(circuit: Circuit, time: float, waveform: Exchange, ends: dict[Node, Sample]) -> None:
    """Torn inputs: through the guessed end value, or from the past alone."""
    polynomials = {
        node: waveform.fit((*node.samples, ends[node]) if ends else node.samples, time) for node, *_ in circuit.unknowns
    }
    for node in circuit.nodes:
        for link in node.torn:
            node.inputs[:, link.targets] = polynomials[link.source][:, link.columns]


def _ends(circuit: Circuit, x: np.ndarray, time: float, length: float, waveform: Exchange) -> dict[Node, Sample]:
    """The guessed samples at the end of the step; the unknowns are end values, and slopes times length where a
    waveform has them."""
    ends, place = {}, 0
    for node, columns, _ in circuit.unknowns:
        n, before = columns.size, node.samples[-1]
        values, rates = before.values.copy(), None
        values[columns] = x[place : place + n]
        place += n
        if waveform.slopes and before.rates is not None:
            rates = before.rates.copy()
            rates[columns] = x[place : place + n] / length
            place += n
        ends[node] = Sample(time + length, values, rates)
    return ends


def _predict(circuit: Circuit, time: float, length: float, settings: Settings) -> np.ndarray:
    """First guess of the unknowns: the parabola through the newest samples carried on. Without iteration it is what
    the waveform makes of the past, so that the residual tells how wrong that was."""
    fit = METHODS["quadratic"].fit if settings.method else settings.waveform.fit
    parts = []
    for node, columns, _ in circuit.unknowns:
        c, ahead = fit(node.samples, time)[:, columns], powers(length)
        parts.append(ahead.dot(c))
        if settings.waveform.slopes:
            parts.append(length * (ahead[:3] @ c[1:]))
    return parts[0] if len(parts) == 1 else np.concatenate(parts)
