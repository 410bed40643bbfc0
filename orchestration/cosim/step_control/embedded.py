"""Embedded control: how far the waveform that was used lies from one of the next degree through the samples that the
step left, at its middle. Nearly free: no step is taken for the estimate alone. It is the error of the inputs over the
step; what it does to the outputs is an order in H smaller."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..extrapolation import METHODS, Sample
from ..master import Master
from .adaptive import Adaptive
from .taken import StepResult

__all__ = ["Embedded"]

COMPARED = {"held": "linear", "linear": "quadratic", "quadratic": "hermite", "hermite": "quadratic"}
NEEDED = {"held": 2, "linear": 3, "quadratic": 3, "hermite": 3}  # samples for the two to differ


@dataclass(frozen=True)
class Embedded(Adaptive):
    def attempt(self, master: Master, time: float, length: float) -> StepResult:
        start = master.place()
        try:
            master.save(start)
            log = master.advance(time, length)
            error = self._error(master, time, length)
            if error is None:
                return StepResult((log,), length)
            following = self.following(length, error, min(master.settings.waveform.order, 3), 2.0)
            if self.rejects(length, error):
                master.rewind(start)
                return StepResult((), following)
            return StepResult((log,), following)
        finally:
            master.release(start)

    def _error(self, master: Master, time: float, length: float) -> float | None:
        """In tolerances; None while there are too few samples behind an event."""
        name = master.settings.waveform.name
        used, other = METHODS[name].fit, METHODS[COMPARED[name]].fit
        gaps = []
        for node in master.nodes:
            if not len(node.subsystem.outputs):
                continue
            if len(node.samples) < NEEDED[name]:
                return None
            gaps.append(_middle(used, node.samples, time, length) - _middle(other, node.samples, time, length))
        return self.error(np.concatenate(gaps), master.nominals(), master.outputs()) if gaps else None


def _middle(fit, samples: tuple[Sample, ...], time: float, length: float) -> np.ndarray:
    c, s = fit(samples, time), 0.5 * length
    return c[0] + s * (c[1] + s * (c[2] / 2.0 + s * c[3] / 6.0))
