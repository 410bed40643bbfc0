"""Polynomials in time for quantities exchanged over a macro step, fitted to their newest samples.

Each fit(samples, t) returns a polynomial about t as rows c0..c3 of an array (4, n),

    u(t + s) = c0 + c1 s + c2 s^2/2 + c3 s^3/6.

Samples are ordered from old to new. Where the newest lies at the end of the step the polynomial interpolates, else it
extrapolates. With too few samples (at the start, after an event) the highest degree that they allow is used.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

__all__ = [
    "METHODS",
    "NOTHING",
    "Extrapolation",
    "Sample",
    "available",
    "reduce_degree",
    "taylor_shift",
    "taylor_weights",
]


class Sample(NamedTuple):
    """The wired outputs of a subsystem at one time.

    Attributes
    ----------
    time : float
        Time [s].
    values : ndarray, shape (n,)
        Outputs in their own units.
    rates : ndarray, shape (n,), or None
        Time derivatives of the outputs; None where they are not offered or not needed.
    """

    time: float
    values: np.ndarray
    rates: np.ndarray | None


NOTHING = Sample(math.nan, np.empty(0), None)  # before the first sample

Fit = Callable[[tuple[Sample, ...], float], np.ndarray]


@dataclass(frozen=True)
class Extrapolation:
    """One method.

    Attributes
    ----------
    name : str
        Word for it in a scene.
    fit : callable
        fit(samples, t), as described in the module.
    order : int
        Global order in the macro step when every exchanged quantity is described so; the degree plus one.
    uses_rates : bool
        Whether time derivatives of the samples are used where they are known.
    needs_derivatives : bool
        Whether they must be known, so that an unknown end value comes with an unknown end slope.
    """

    name: str
    fit: Fit
    order: int
    uses_rates: bool = False
    needs_derivatives: bool = False


def taylor_weights(s: float) -> np.ndarray:
    """Return w (4,) with w @ c the values at t + s of a polynomial c about t; its slopes are w[:3] @ c[1:]."""
    return np.array((1.0, s, s * s / 2.0, s * s * s / 6.0))


def taylor_shift(s: float) -> np.ndarray:
    """Return M (4, 4) with M @ c the polynomial c about t written about t + s."""
    _, s, square, cube = taylor_weights(s)
    return np.array(((1.0, s, square, cube), (0.0, 1.0, s, square), (0.0, 0.0, 1.0, s), (0.0, 0.0, 0.0, 1.0)))


def fit_constant(samples: tuple[Sample, ...], t: float) -> np.ndarray:
    """Return the newest value, degree 0."""
    newest = samples[-1].values
    polynomial = np.zeros((4, newest.size))
    polynomial[0] = newest
    return polynomial


def fit_line(samples: tuple[Sample, ...], t: float) -> np.ndarray:
    """Return the line through the two newest values, degree 1."""
    if len(samples) < 2:
        return fit_constant(samples, t)
    a, b = samples[-2:]
    polynomial = np.zeros((4, a.values.size))
    polynomial[1] = slope = (b.values - a.values) / (b.time - a.time)
    polynomial[0] = a.values + slope * (t - a.time)
    return polynomial


def fit_parabola(samples: tuple[Sample, ...], t: float) -> np.ndarray:
    """Return the parabola through the three newest values, degree 2.

    Newton's divided differences, about the newest sample. Two samples give it with the time derivative of the first in
    place of the third value, one sample gives its tangent.
    """
    if len(samples) < 3:
        return fit_cubic(tuple(s if s is samples[0] else s._replace(rates=None) for s in samples), t)
    a, b, c = samples[-3:]
    before, after = (b.values - a.values) / (b.time - a.time), (c.values - b.values) / (c.time - b.time)
    bend = (after - before) * (2.0 / (c.time - a.time))
    slope = after + bend * (0.5 * (c.time - b.time))  # at c
    polynomial = np.array((c.values, slope, bend, np.zeros_like(bend)))
    return polynomial if c.time == t else taylor_shift(t - c.time) @ polynomial


def fit_cubic(samples: tuple[Sample, ...], t: float) -> np.ndarray:
    """Return the Hermite cubic of the two newest samples, from their values and time derivatives, degree 3.

    One sample gives its tangent. Where the newest sample has no time derivative (a guessed end value), the result is
    the parabola through both values and the first derivative.
    """
    a = samples[-2] if len(samples) > 1 else samples[-1]
    if a.rates is None:
        return fit_line(samples, t)
    polynomial = _cubic_between(a, samples[-1])
    return polynomial if a.time == t else taylor_shift(t - a.time) @ polynomial


def _cubic_between(a: Sample, b: Sample) -> np.ndarray:
    """Return the polynomial about a. Columns are few, so the number of numpy calls decides how long it takes."""
    if b is a:
        zeros = np.zeros_like(a.values)
        return np.array((a.values, a.rates, zeros, zeros))
    h, rise = b.time - a.time, b.values - a.values
    if b.rates is None:
        return np.array((a.values, a.rates, (rise / h - a.rates) * (2.0 / h), np.zeros_like(rise)))
    cubic: np.ndarray = _hermite_weights(h).dot(np.array((a.values, a.rates, rise, b.rates)))
    return cubic


@lru_cache(maxsize=256)  # steps of one length ask for it again and again
def _hermite_weights(h: float) -> np.ndarray:
    """Return W (4, 4) that maps value and slope at the start, rise over h [s], and slope at the end to c0..c3.

    The rise stands in place of the end value, so that derivatives of constants are exactly zero.
    """
    return np.array(
        (
            (1.0, 0.0, 0.0, 0.0),
            (0.0, 1.0, 0.0, 0.0),
            (0.0, -4.0 / h, 6.0 / h**2, -2.0 / h),
            (0.0, 6.0 / h**2, -12.0 / h**3, 6.0 / h**2),
        )
    )


METHODS = {
    "held": Extrapolation("held", fit_constant, order=1),
    "linear": Extrapolation("linear", fit_line, order=2),
    "quadratic": Extrapolation("quadratic", fit_parabola, order=3, uses_rates=True),
    "hermite": Extrapolation("hermite", fit_cubic, order=4, uses_rates=True, needs_derivatives=True),
}

BY_DEGREE = ("held", "linear", "quadratic", "hermite")


def available(method: Extrapolation, degree: int, has_rates: bool) -> Extrapolation:
    """Return the method, or what comes closest to it.

    Parameters
    ----------
    method : Extrapolation
        What is asked for.
    degree : int
        Highest degree of polynomials that the target takes.
    has_rates : bool
        Whether the source offers time derivatives.
    """
    if method.needs_derivatives and not has_rates:
        method = METHODS["quadratic"]
    return METHODS[BY_DEGREE[degree]] if method.order - 1 > degree else method


def reduce_degree(c: tuple[float, float, float, float], h: float, degree: int) -> tuple[float, float, float, float]:
    """Return a polynomial of lower degree in place of c over a step of h [s].

    Degree 0 holds the end value, as an exchange of that degree does, 1 keeps the values at both ends, 2 the mean too.
    """
    c0, c1, c2, c3 = c
    end = c0 + h * (c1 + h * (c2 / 2.0 + h * c3 / 6.0))
    if degree == 0:
        return (end, 0.0, 0.0, 0.0)
    if degree == 1:
        return (c0, (end - c0) / h, 0.0, 0.0)
    if degree == 2:
        mean = c0 + h * (c1 / 2.0 + h * (c2 / 6.0 + h * c3 / 24.0))
        bend = 12.0 * (0.5 * (end - c0) - (mean - c0)) / h**2
        return (c0, (end - c0) / h - 0.5 * h * bend, bend, 0.0)
    return c
