// Polynomial in time by its derivatives at the start of a step:
//     u(s) = u[0] + u[1] s + u[2] s^2/2! + u[3] s^3/3! + ...,   s [s] after the start, u[j] in the unit of u per s^j.
// FMI's inputs with derivatives have this form (FMI 2.0.4, section 4.2.1, fmi2SetRealInputDerivatives).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

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

struct Extremes {
  double least, most;
};

/// Least and largest value of a cubic over [0, h], h [s] > 0. Not finite where an intermediate power of h overflows.
inline Extremes extremes(const Cubic& u, double h) {
  const double at_end = value(u, h);
  Extremes result{std::min(u[0], at_end), std::max(u[0], at_end)};
  if (!std::isfinite(at_end)) return {at_end, at_end};
  const auto include = [&](double s) {
    if (!(s > 0.0 && s < h)) return;
    result.least = std::min(result.least, value(u, s));
    result.most = std::max(result.most, value(u, s));
  };
  // Zeros of the rate u1 + u2 s + u3 s^2/2, by the form that does not cancel.
  const double a = 0.5 * u[3], b = u[2], c = u[1], square = b * b - 4.0 * a * c;
  if (square < 0.0) return result;
  const double q = -0.5 * (b + std::copysign(std::sqrt(square), b));
  if (q != 0.0) include(c / q);
  if (a != 0.0) include(q / a);
  return result;
}

/// True when no derivative differs from 0.
template <std::size_t terms>
constexpr bool is_constant(const TimePolynomial<terms>& u) {
  std::uint64_t bits = 0;  // of all: branches would cost more than the comparison
  for (std::size_t j = 1; j < terms; ++j) bits |= std::bit_cast<std::uint64_t>(u[j]);
  return bits << 1 == 0;  // without the sign
}

}  // namespace core
