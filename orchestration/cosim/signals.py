"""Inputs as functions of time: constant, steps, ramps, sine, half-sine impulse, pulses.

Values are in the variable's own unit, times in s. polynomial(t, h) returns (c0, c1, c2, c3) of

    u(t + s) = c0 + c1 s + c2 s^2/2 + c3 s^3/6

over a macro step without a break inside. It is exact for constants, steps and ramps. For sines it is the cubic with
their end values, mean and first moment over the step. Its error is (omega h)^4/1920 of the amplitude, and what
integrates it, such as a body that is hit, receives the whole impulse, however short that is compared with the step.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

__all__ = ["Constant", "Impulse", "Ramps", "Signal", "Sine", "Steps", "pulses"]

Polynomial = tuple[float, float, float, float]


class Signal(Protocol):
    """A function of time."""

    @property
    def degree(self) -> int:
        """Highest degree of its polynomials."""

    @property
    def breaks(self) -> tuple[float, ...]:
        """Times at which the value or its slope jumps [s]."""

    @property
    def extremes(self) -> tuple[float, ...]:
        """Values that bound the signal."""

    def polynomial(self, t: float, h: float) -> Polynomial:
        """Return the coefficients for a step from t of h [s]."""


@dataclass(frozen=True)
class Constant:
    """One value for all times."""

    value: float

    degree = 0
    breaks = ()

    @property
    def extremes(self) -> tuple[float, ...]:
        """Values that bound the signal."""
        return (self.value,)

    def polynomial(self, t: float, h: float) -> Polynomial:
        """Return the coefficients for a step from t of h [s]."""
        return (self.value, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Steps:
    """Piecewise constant: values[k] from times[k] [s] on, values[0] also before times[0]."""

    times: tuple[float, ...]
    values: tuple[float, ...]

    degree = 0

    @property
    def breaks(self) -> tuple[float, ...]:
        """Times at which the value or its slope jumps [s]."""
        return self.times[1:]

    @property
    def extremes(self) -> tuple[float, ...]:
        """Values that bound the signal."""
        return self.values

    def polynomial(self, t: float, h: float) -> Polynomial:
        """Return the coefficients for a step from t of h [s]."""
        # The middle of the step decides, so that rounding of its start does no harm.
        return (self.values[max(bisect_right(self.times, t + 0.5 * h) - 1, 0)], 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Ramps:
    """Straight lines between (times[k] [s], values[k]); constant before the first and after the last."""

    times: tuple[float, ...]
    values: tuple[float, ...]

    degree = 1

    @property
    def breaks(self) -> tuple[float, ...]:
        """Times at which the value or its slope jumps [s]."""
        return self.times

    @property
    def extremes(self) -> tuple[float, ...]:
        """Values that bound the signal."""
        return self.values

    def polynomial(self, t: float, h: float) -> Polynomial:
        """Return the coefficients for a step from t of h [s]."""
        k = bisect_right(self.times, t + 0.5 * h)
        if k == 0 or k == len(self.times):
            return (self.values[0 if k == 0 else -1], 0.0, 0.0, 0.0)
        slope = (self.values[k] - self.values[k - 1]) / (self.times[k] - self.times[k - 1])
        return (self.values[k - 1] + slope * (t - self.times[k - 1]), slope, 0.0, 0.0)


@dataclass(frozen=True)
class Sine:
    """A sine: offset + amplitude sin(2 pi t/period + phase), with period [s] and phase [rad]."""

    offset: float
    amplitude: float
    period: float
    phase: float = 0.0

    degree = 3
    breaks = ()

    @property
    def extremes(self) -> tuple[float, ...]:
        """Values that bound the signal."""
        return (self.offset - abs(self.amplitude), self.offset + abs(self.amplitude))

    def polynomial(self, t: float, h: float) -> Polynomial:
        """Return the coefficients for a step from t of h [s]."""
        return _sinusoid(self.offset, self.amplitude, 2.0 * math.pi / self.period, self.phase, t, h)


@dataclass(frozen=True)
class Impulse:
    """Half a sine wave: peak sin(pi (t - start)/width) for start < t < start + width [s], 0 outside."""

    peak: float
    width: float
    start: float = 0.0

    degree = 3

    @property
    def breaks(self) -> tuple[float, ...]:
        """Times at which the value or its slope jumps [s]."""
        return (self.start, self.start + self.width)

    @property
    def extremes(self) -> tuple[float, ...]:
        """Values that bound the signal."""
        return (0.0, self.peak)

    def polynomial(self, t: float, h: float) -> Polynomial:
        """Return the coefficients for a step from t of h [s]."""
        if not self.start < t + 0.5 * h < self.start + self.width:
            return (0.0, 0.0, 0.0, 0.0)
        rate = math.pi / self.width
        return _sinusoid(0.0, self.peak, rate, -rate * self.start, t, h)


def pulses(low: float, high: float, width: float, period: float, count: int, start: float = 0.0) -> Steps:
    """Return a train of `count` rectangular pulses: `high` for `width` [s], every `period` [s] from `start` [s] on."""
    times = [start + k * period + edge for k in range(count) for edge in (0.0, width)]
    values = [high, low] * count
    return Steps(tuple(times), tuple(values)) if start <= 0.0 else Steps((0.0, *times), (low, *values))


def _sinusoid(offset: float, amplitude: float, rate: float, phase: float, t: float, h: float) -> Polynomial:
    """Return the cubic for offset + amplitude sin(rate t + phase).

    In Legendre polynomials P_n of xi in (-1, 1) over the step. With x = rate h/2 and the phase p in the middle the
    signal is amplitude (sin p cos(x xi) + cos p sin(x xi)). Its mean is j0 sin p and its share of P_1, the first
    moment, is 3 j1 cos p, with the spherical Bessel functions j_n(x). P_2 and P_3 are chosen to meet the end values,
    for which cos x - j0 = -x j1 and sin x - 3 j1 = -x j2.
    """
    x = 0.5 * rate * h
    middle = rate * t + phase + x
    even, odd = amplitude * math.sin(middle), amplitude * math.cos(middle)
    j1, j2 = _bessel(x)
    p1, p2, p3 = 3.0 * j1 * odd, -x * j1 * even, -x * j2 * odd
    k = 2.0 / h
    return (
        offset + amplitude * math.sin(rate * t + phase),
        k * (p1 - 3.0 * p2 + 6.0 * p3),
        k * k * (3.0 * p2 - 15.0 * p3),
        k * k * k * 15.0 * p3,
    )


@lru_cache(maxsize=256)  # steps of one length ask for it again and again
def _bessel(x: float) -> tuple[float, float]:
    """Return the spherical Bessel functions j1 and j2; series for small x, where their closed forms cancel."""
    if abs(x) > 1.0:
        j0 = math.sin(x) / x
        j1 = (j0 - math.cos(x)) / x
        return j1, 3.0 * j1 / x - j0
    one = two = 1.0  # sums of (-x^2/2)^k/(k! (2n+3) (2n+5) ... (2n+2k+1)), innermost term first
    for k in range(8, 0, -1):
        one = 1.0 - x * x / (2 * k * (2 * k + 3)) * one
        two = 1.0 - x * x / (2 * k * (2 * k + 5)) * two
    return x / 3.0 * one, x * x / 15.0 * two
