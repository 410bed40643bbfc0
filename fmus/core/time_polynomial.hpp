// Polynomial in time by its derivatives at the start of a step:
//     u(s) = u[0] + u[1] s + u[2] s^2/2! + u[3] s^3/3! + ...,   s [s] after the start, u[j] in the unit of u per s^j.
// FMI's inputs with derivatives have this form (FMI 2.0.4, section 4.2.1, fmi2SetRealInputDerivatives).
#pragma once

#include <array>
#include <cstddef>

namespace core {

/// Value and the first `terms` - 1 time derivatives at the start.
template <std::size_t terms>
using TimePolynomial = std::array<double, terms>;

/// A continuous input of an FMU during one communication step: value and three derivatives.
using Cubic = TimePolynomial<4>;

/// The derivative of order `order` (0: the value) at s [s], by Horner's rule.
template <std::size_t terms>
constexpr double derivative(const TimePolynomial<terms>& u, double s, std::size_t order) {
  double sum = u[terms - 1];
  for (std::size_t j = terms - 1; j-- > order;) sum = u[j] + s / static_cast<double>(j + 1 - order) * sum;
  return sum;
}

/// The value at s [s].
template <std::size_t terms>
constexpr double value(const TimePolynomial<terms>& u, double s) {
  return derivative(u, s, 0);
}

/// The first time derivative at s [s].
template <std::size_t terms>
constexpr double rate(const TimePolynomial<terms>& u, double s) {
  return derivative(u, s, 1);
}

/// The same polynomial with its start moved to s [s].
template <std::size_t terms>
constexpr TimePolynomial<terms> shifted(const TimePolynomial<terms>& u, double s) {
  TimePolynomial<terms> moved{};
  for (std::size_t order = 0; order < terms; ++order) moved[order] = derivative(u, s, order);
  return moved;
}

/// True when no derivative differs from 0.
template <std::size_t terms>
constexpr bool is_constant(const TimePolynomial<terms>& u) {
  for (std::size_t j = 1; j < terms; ++j)
    if (u[j] != 0.0) return false;
  return true;
}

}  // namespace core
