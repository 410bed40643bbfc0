"""What controls share that adapt the step to an estimated error: errors are shares of tolerance (nominal + |y|), rms
over the wired outputs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["Adaptive"]


@dataclass(frozen=True)
class Adaptive:
    step: float  # first length [s]
    tolerance: float
    least: float  # [s]
    most: float  # [s]

    def error(self, gap: np.ndarray, nominal: np.ndarray, values: np.ndarray) -> float:
        """Of outputs (n,) that are off by gap (n,)."""
        return float(np.sqrt(np.mean((gap / (self.tolerance * (nominal + np.abs(values)))) ** 2)))

    def following(self, length: float, error: float, order: float, fastest: float) -> float:
        """The length [s] at which an error that goes with its power `order` would be 0.9^order."""
        factor = 0.9 * max(error, 1e-12) ** (-1.0 / order)
        return float(np.clip(length * np.clip(factor, 0.2, fastest), self.least, self.most))

    def rejects(self, length: float, error: float) -> bool:
        return error > 1.0 and length > self.least
