"""Step doubling: one step of H against two of H/2, whose difference over 2^(k+1) - 1 estimates the error of the two;
k + 1 is the order of the waveform. The two are kept."""

from __future__ import annotations

from dataclasses import dataclass

from ..master import Master
from .adaptive import Adaptive
from .taken import StepResult

__all__ = ["Doubling"]


@dataclass(frozen=True)
class Doubling(Adaptive):
    def attempt(self, master: Master, time: float, length: float) -> StepResult:
        order = master.settings.waveform.order
        start = master.place()
        try:
            master.save(start)
            master.advance(time, length)
            whole = master.outputs()
            master.rewind(start)
            half = 0.5 * length
            steps = (master.advance(time, half), master.advance(time + half, half))
            pair = master.outputs()
            error = self.error(pair - whole, master.nominals(), pair) / (2.0**order - 1.0)
            following = self.following(length, error, order + 1.0, 6.0)
            if self.rejects(length, error):
                master.rewind(start)
                return StepResult((), following)
            return StepResult(steps, following)
        except BaseException:
            if start.handles:
                master.rewind(start)
            raise
        finally:
            master.release(start)
