"""Embedded control: how far the waveform that was used lies from one of the next degree through the samples that the
step left, at its middle. Nearly free: no step is taken for the estimate alone. It is the error of the inputs over the
step; what it does to the outputs is an order in H smaller. Scaled by tolerance (nominal + |y|), rms over the wired
outputs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..exchange import METHODS, Sample
from ..master import Master
from .taken import Taken

__all__ = ["Embedded"]

COMPARED = {"held": "linear", "linear": "quadratic", "quadratic": "hermite", "hermite": "quadratic"}
NEEDED = {"held": 2, "linear": 3, "quadratic": 3, "hermite": 3}  # samples for the two to differ


@dataclass(frozen=True)
class Embedded:
    step: float  # first length [s]
    tolerance: float
    least: float  # [s]
    most: float  # [s]

    def take(self, master: Master, time: float, length: float) -> Taken:
        start = master.place()
        try:
            master.save(start)
            log = master.advance(time, length)
            error = self._error(master, time, length)
            if error is None:
                return Taken((log,), length)
            power = -1.0 / min(master.settings.waveform.order, 3)
            factor = 0.9 * max(error, 1e-12) ** power
            following = float(np.clip(length * np.clip(factor, 0.2, 2.0), self.least, self.most))
            if error > 1.0 and length > self.least:
                master.rewind(start)
                return Taken((), following)
            return Taken((log,), following)
        finally:
            master.release(start)

    def _error(self, master: Master, time: float, length: float) -> float | None:
        """In tolerances; None while there are too few samples behind an event."""
        name = master.settings.waveform.name
        used, other = METHODS[name].fit, METHODS[COMPARED[name]].fit
        parts = []
        for node in master.nodes:
            if not len(node.subsystem.outputs):
                continue
            if len(node.samples) < NEEDED[name]:
                return None
            gap = _middle(used, node.samples, time, length) - _middle(other, node.samples, time, length)
            nominal = np.array([port.nominal for port in node.subsystem.outputs])
            parts.append(gap / (self.tolerance * (nominal + np.abs(node.samples[-1].values))))
        return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) if parts else None


def _middle(fit, samples: tuple[Sample, ...], time: float, length: float) -> np.ndarray:
    c, s = fit(samples, time), 0.5 * length
    return c[0] + s * (c[1] + s * (c[2] / 2.0 + s * c[3] / 6.0))
