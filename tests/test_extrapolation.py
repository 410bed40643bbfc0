"""Polynomials through samples: exact for polynomials of their degree, inside the samples and outside."""

from __future__ import annotations

import numpy as np
import pytest
from tca_cosim.cosim.extrapolation import METHODS, Sample, available, reduce_degree

DEGREE = {"held": 0, "linear": 1, "quadratic": 2, "hermite": 3}


def samples(coefficients: np.ndarray, times: list[float]) -> tuple[Sample, ...]:
    u = np.polynomial.Polynomial(coefficients)
    return tuple(Sample(t, np.array([u(t), -2.0 * u(t)]), np.array([u.deriv()(t), -2.0 * u.deriv()(t)])) for t in times)


def value(polynomial: np.ndarray, s: float) -> np.ndarray:
    return polynomial[0] + s * (polynomial[1] + s * (polynomial[2] / 2.0 + s * polynomial[3] / 6.0))


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("times", [[0.1, 0.4, 0.9], [0.1, 0.4, 0.9, 1.3]], ids=["extrapolating", "interpolating"])
def test_polynomials_of_the_degree_are_exact(name: str, times: list[float]) -> None:
    coefficients = np.array([0.7, -1.3, 0.4, 2.1])[: DEGREE[name] + 1]
    polynomial = METHODS[name].fit(samples(coefficients, times), 0.9)
    exact = np.polynomial.Polynomial(coefficients)
    for s in (0.0, 0.1, 0.4):
        np.testing.assert_allclose(value(polynomial, s), [exact(0.9 + s), -2.0 * exact(0.9 + s)], rtol=1e-12)


@pytest.mark.parametrize("name", METHODS)
def test_one_degree_more_is_not_exact(name: str) -> None:
    coefficients = np.array([0.7, -1.3, 0.4, 2.1, 1.0])[: DEGREE[name] + 2]
    polynomial = METHODS[name].fit(samples(coefficients, [0.1, 0.4, 0.9]), 0.9)
    assert abs(value(polynomial, 0.4)[0] - np.polynomial.Polynomial(coefficients)(1.3)) > 1e-3


@pytest.mark.parametrize("name", ["quadratic", "hermite"])
def test_few_samples_give_the_degree_that_they_allow(name: str) -> None:
    line, parabola = np.array([0.7, -1.3]), np.array([0.7, -1.3, 0.4])
    one = METHODS[name].fit(samples(line, [0.4]), 0.9)
    assert value(one, 0.3)[0] == pytest.approx(0.7 - 1.3 * 1.2)
    first, second = samples(parabola, [0.4, 0.9])
    two = METHODS[name].fit((first, second._replace(rates=None)), 0.9)
    assert value(two, 0.3)[0] == pytest.approx(np.polynomial.Polynomial(parabola)(1.2))


def test_without_rates_one_sample_is_held() -> None:
    (sample,) = samples(np.array([0.7, -1.3]), [0.4])
    for method in METHODS.values():
        assert value(method.fit((sample._replace(rates=None),), 0.4), 0.5)[0] == sample.values[0]


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_a_lower_degree_keeps_ends_and_mean(degree: int) -> None:
    """0: the end value; 1: both ends; 2: the mean too; what is of that degree already stays."""
    c, h = (0.7, -1.3, 0.8, 12.6), 0.4
    lower = reduce_degree(c, h, degree)
    s = np.linspace(0.0, h, 4001)
    exact, actual = value(np.array(c), s), value(np.array(lower), s)
    assert not any(lower[degree + 1 :])
    assert actual[-1] == pytest.approx(exact[-1])
    if degree > 0:
        assert actual[0] == pytest.approx(exact[0])
    if degree > 1:
        assert np.trapezoid(actual, s) == pytest.approx(np.trapezoid(exact, s), rel=1e-6)
    own = (*c[: degree + 1], *(0.0,) * (3 - degree))
    assert reduce_degree(own, h, degree) == pytest.approx(own)


def test_a_method_is_replaced_by_the_best_that_both_ends_allow() -> None:
    for method in METHODS.values():
        for degree in range(4):
            for has_rates in (False, True):
                actual = available(method, degree, has_rates)
                assert actual.order - 1 <= degree
                assert has_rates or not actual.needs_derivatives
                assert actual is method or actual.order < method.order
