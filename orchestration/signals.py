"""Inputs as functions of time: constant, steps, ramps, sine, half-sine impulse, pulses. Values are in the variable's
own unit, times in s.

polynomial(t, h) gives (c0, c1, c2, c3) of u(t+s) = c0 + c1 s + c2 s^2/2 + c3 s^3/6 over a macro step that crosses no
break: exact for constant, steps and ramps, the cubic Hermite interpolant for sines (relative error (omega
h)^4/384)."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from typing import Protocol

__all__ = ["Constant", "Impulse", "Ramps", "Signal", "Sine", "Steps", "pulses"]

Polynomial = tuple[float, float, float, float]


class Signal(Protocol):
    @property
    def breaks(self) -> tuple[float, ...]:
        """Times at which the value or its slope jumps."""

    @property
    def extremes(self) -> tuple[float, ...]:
        """Values that bound the signal."""

    def polynomial(self, t: float, h: float) -> Polynomial: ...


@dataclass(frozen=True)
class Constant:
    value: float

    breaks = ()

    @property
    def extremes(self) -> tuple[float, ...]:
        return (self.value,)

    def polynomial(self, t: float, h: float) -> Polynomial:
        return (self.value, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Steps:
    """values[k] holds from times[k] on; before times[0] values[0] holds too."""

    times: tuple[float, ...]
    values: tuple[float, ...]

    @property
    def breaks(self) -> tuple[float, ...]:
        return self.times[1:]

    @property
    def extremes(self) -> tuple[float, ...]:
        return self.values

    def polynomial(self, t: float, h: float) -> Polynomial:
        # The middle of the step decides, so a start that misses a break by rounding does no harm.
        return (self.values[max(bisect_right(self.times, t + 0.5 * h) - 1, 0)], 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Ramps:
    """Straight lines between (times[k], values[k]); held before the first and after the last."""

    times: tuple[float, ...]
    values: tuple[float, ...]

    @property
    def breaks(self) -> tuple[float, ...]:
        return self.times

    @property
    def extremes(self) -> tuple[float, ...]:
        return self.values

    def polynomial(self, t: float, h: float) -> Polynomial:
        k = bisect_right(self.times, t + 0.5 * h)
        if k == 0 or k == len(self.times):
            return (self.values[0 if k == 0 else -1], 0.0, 0.0, 0.0)
        slope = (self.values[k] - self.values[k - 1]) / (self.times[k] - self.times[k - 1])
        return (self.values[k - 1] + slope * (t - self.times[k - 1]), slope, 0.0, 0.0)


@dataclass(frozen=True)
class Sine:
    """offset + amplitude sin(2 pi t/period + phase)"""

    offset: float
    amplitude: float
    period: float  # [s]
    phase: float = 0.0  # [rad]

    breaks = ()

    @property
    def extremes(self) -> tuple[float, ...]:
        return (self.offset - abs(self.amplitude), self.offset + abs(self.amplitude))

    def polynomial(self, t: float, h: float) -> Polynomial:
        rate = 2.0 * math.pi / self.period
        start, end = rate * t + self.phase, rate * (t + h) + self.phase
        a, b = self.offset + self.amplitude * math.sin(start), self.offset + self.amplitude * math.sin(end)
        da, db = self.amplitude * rate * math.cos(start), self.amplitude * rate * math.cos(end)
        mean = (b - a) / h
        cubic = (da + db - 2.0 * mean) / (h * h)
        return (a, da, 2.0 * ((mean - da) / h - cubic * h), 6.0 * cubic)


@dataclass(frozen=True)
class Impulse:
    """Half a sine wave, peak sin(pi (t - start)/width) for start < t < start + width; 0 outside."""

    peak: float
    width: float  # [s]
    start: float = 0.0  # [s]

    @property
    def breaks(self) -> tuple[float, ...]:
        return (self.start, self.start + self.width)

    @property
    def extremes(self) -> tuple[float, ...]:
        return (0.0, self.peak)

    def polynomial(self, t: float, h: float) -> Polynomial:
        if not self.start < t + 0.5 * h < self.start + self.width:
            return (0.0, 0.0, 0.0, 0.0)
        return Sine(0.0, self.peak, 2.0 * self.width, -math.pi * self.start / self.width).polynomial(t, h)


def pulses(low: float, high: float, width: float, period: float, count: int, start: float = 0.0) -> Steps:
    """A train of `count` rectangular pulses, `high` for `width` [s] once every `period` [s] from `start` [s] on."""
    times = [start + k * period + edge for k in range(count) for edge in (0.0, width)]
    values = [high, low] * count
    return Steps(tuple(times), tuple(values)) if start <= 0.0 else Steps((0.0, *times), (low, *values))
