"""Control of the macro step's length.

A control is a frozen value with attempt(master, step) -> StepResult: it tries the step, and says which steps were
accepted and which length it would take next. StepError of the master passes through; the time loop
retries with a shorter step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from .extrapolation import METHODS, Fit, Sample
from .master import Master, StepLog
from .node import MacroStep

__all__ = ["Control", "Doubling", "Embedded", "Fixed", "StepResult"]

SAFETY = 0.9  # share of the length that would just meet the tolerance, so that most next steps are accepted
SHRINK = 0.2  # least ratio of a length to the one before: a single estimate is not trusted further
ERROR_FLOOR = 1e-12  # in tolerances: keeps the ratio finite where the estimate is zero
# Waveform of another degree that the one in use is compared with, and the samples needed for the two to differ.
COMPARED = {"held": "linear", "linear": "quadratic", "quadratic": "hermite", "hermite": "quadratic"}
NEEDED = {"held": 2, "linear": 3, "quadratic": 3, "hermite": 3}


class StepResult(NamedTuple):
    """Outcome of an attempt.

    Attributes
    ----------
    steps : tuple of StepLog
        Accepted steps in order; empty where the attempt was rejected.
    next_length : float
        Length to try next [s].
    """

    steps: tuple[StepLog, ...]
    next_length: float


class Control(Protocol):
    """What the time loop needs of a control."""

    @property
    def step(self) -> float:
        """First length [s]."""

    @property
    def equidistant(self) -> bool:
        """Whether steps end at multiples of the first length."""

    def attempt(self, master: Master, step: MacroStep) -> StepResult:
        """Try a step. Raises StepError with everything as it was."""


@dataclass(frozen=True)
class Fixed:
    """Steps of one length [s]."""

    step: float
    equidistant = True

    def attempt(self, master: Master, step: MacroStep) -> StepResult:
        """Take the step."""
        return StepResult((master.advance(step),), self.step)


@dataclass(frozen=True)
class Adaptive:
    """Common part of the controls that adapt the length to an estimated error.

    Errors are shares of tolerance * (nominal + |y|), root mean square over the wired outputs.

    Attributes
    ----------
    step : float
        First length [s].
    tolerance : float
        Error allowed per step.
    least, most : float
        Bounds of the length [s].
    """

    step: float
    tolerance: float
    least: float
    most: float
    equidistant = False

    def error(self, difference: np.ndarray, nominals: np.ndarray, values: np.ndarray) -> float:
        """Return the norm of a difference (n,) between outputs of size `values` (n,), in tolerances."""
        return float(np.sqrt(np.mean((difference / (self.tolerance * (nominals + np.abs(values)))) ** 2)))

    def next_length(self, length: float, error: float, order: float, growth: float) -> float:
        """Return the length [s] that meets the tolerance if the error is proportional to length^order."""
        factor = SAFETY * max(error, ERROR_FLOOR) ** (-1.0 / order)
        return float(np.clip(length * np.clip(factor, SHRINK, growth), self.least, self.most))

    def rejects(self, length: float, error: float) -> bool:
        """Return whether the step is to be repeated with a shorter length."""
        return error > 1.0 and length > self.least


@dataclass(frozen=True)
class Doubling(Adaptive):
    """Step doubling: one step of H is compared with two of H/2, which are kept.

    With an error of order p = k + 1 for waveforms of degree k, the difference over 2^p - 1 estimates the error of the
    two (Hairer, Norsett, Wanner, Solving ODEs I, II.4).
    """

    def attempt(self, master: Master, step: MacroStep) -> StepResult:
        """Take the step whole and in halves."""
        time, length, _ = step
        order = master.settings.torn.order
        start = master.checkpoint()
        try:
            master.save(start)
            master.advance(step)
            whole = master.outputs()
            master.rewind(start)
            half = 0.5 * length
            middle = time + half
            steps = (
                master.advance(MacroStep(time, half, middle)),
                master.advance(MacroStep(middle, half, step.end)),
            )
            pair = master.outputs()
            error = self.error(pair - whole, master.nominals(), pair) / (2.0**order - 1.0)
            next_length = self.next_length(length, error, order + 1.0, 6.0)
            if self.rejects(length, error):
                master.rejected += 1
                master.rewind(start)
                return StepResult((), next_length)
            return StepResult(steps, next_length)
        except BaseException:
            if start.handles:
                master.rewind(start)
            raise
        finally:
            master.release(start)


@dataclass(frozen=True)
class Embedded(Adaptive):
    """Comparison, in the middle of a step, of the waveform in use with one of the next degree through the same samples.

    No step is taken for the estimate alone. It is the error of the inputs over the step; its effect on the outputs is
    an order in H smaller.
    """

    def attempt(self, master: Master, step: MacroStep) -> StepResult:
        """Take one step and compare."""
        time, length, _ = step
        start = master.checkpoint()
        try:
            master.save(start)
            log = master.advance(step)
            error = self._error(master, time, length)
            if error is None:
                return StepResult((log,), length)
            next_length = self.next_length(length, error, min(master.settings.torn.order, 3), 2.0)
            if self.rejects(length, error):
                master.rejected += 1
                master.rewind(start)
                return StepResult((), next_length)
            return StepResult((log,), next_length)
        finally:
            master.release(start)

    def _error(self, master: Master, time: float, length: float) -> float | None:
        """Return the estimate in tolerances; None while there are too few samples after an event."""
        name = master.settings.torn.name
        used, other = METHODS[name].fit, METHODS[COMPARED[name]].fit
        differences = []
        for node in master.nodes:
            if not len(node.subsystem.outputs):
                continue
            if len(node.samples) < NEEDED[name]:
                return None
            differences.append(_middle(used, node.samples, time, length) - _middle(other, node.samples, time, length))
        return self.error(np.concatenate(differences), master.nominals(), master.outputs()) if differences else None


def _middle(fit: Fit, samples: tuple[Sample, ...], time: float, length: float) -> np.ndarray:
    """Return the values (n,) in the middle of the step."""
    c, s = fit(samples, time), 0.5 * length
    middle: np.ndarray = c[0] + s * (c[1] + s * (c[2] / 2.0 + s * c[3] / 6.0))
    return middle
