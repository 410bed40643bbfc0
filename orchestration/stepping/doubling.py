"""Step doubling: one step of H against two of H/2, whose difference over 2^(k+1) - 1 estimates the error of the two;
k + 1 is the order of the waveform. The two are kept. Scaled by tolerance (nominal + |y|), rms over the wired
outputs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..master import Master
from .taken import Taken

__all__ = ["Doubling"]


@dataclass(frozen=True)
class Doubling:
    step: float  # first length [s]
    tolerance: float
    least: float  # [s]
    most: float  # [s]

    def take(self, master: Master, time: float, length: float) -> Taken:
        order = master.settings.waveform.order
        start = master.place()
        try:
            master.save(start)
            master.advance(time, length)
            whole = master.outputs()
            master.rewind(start)
            half = 0.5 * length
            steps = (master.advance(time, half), master.advance(time + half, half))
            pair, scale = master.outputs(), master.nominals()
            error = np.sqrt(np.mean(((pair - whole) / (self.tolerance * (scale + np.abs(pair)))) ** 2)) / (
                2.0**order - 1.0
            )
            factor = 0.9 * max(error, 1e-12) ** (-1.0 / (order + 1.0))
            following = float(np.clip(length * np.clip(factor, 0.2, 6.0), self.least, self.most))
            if error > 1.0 and length > self.least:
                master.rewind(start)
                return Taken((), following)
            return Taken(steps, following)
        except BaseException:
            if start.handles:
                master.rewind(start)
            raise
        finally:
            master.release(start)
