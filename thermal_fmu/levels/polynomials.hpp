// Polynomials in time by their derivatives at the start of a step: powers of cubic voltages, and how far they travel.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "levels/heat_level.hpp"

namespace thermal {

inline constexpr int kPowerTerms = 7;  // a cubic's square has degree 6
using Sextic = core::TimePolynomial<kPowerTerms>;

/// Derivatives of the square, by Leibniz' rule.
inline Sextic square(const Cubic& c) {
  const double a = c[0], b = c[1], d = c[2], e = c[3];
  return {a * a,        2.0 * a * b, 2.0 * (a * d + b * b), 2.0 * a * e + 6.0 * b * d, 8.0 * b * e + 6.0 * d * d,
          20.0 * d * e, 20.0 * e * e};
}

/// Upper bound of the total variation over [0, h]: that of the Bernstein control polygon, which a polynomial never
/// exceeds.
template <std::size_t terms>
double variation(const std::array<double, terms>& derivatives, double h) {
  constexpr std::size_t degree = terms - 1;
  std::array<double, terms> control{};  // b_i = sum_j C(i,j)/C(n,j) a_j, a_j the coefficient of (s/h)^j
  double scale = 1.0;                   // h^j / j!
  for (std::size_t j = 0; j <= degree; ++j) {
    double ratio = scale * derivatives[j];  // C(i,j)/C(n,j) at i = n, then downwards
    for (std::size_t i = degree + 1; i-- > j;) {
      control[i] += ratio;
      ratio *= i > j ? static_cast<double>(i - j) / static_cast<double>(i) : 0.0;
    }
    scale *= h / static_cast<double>(j + 1);
  }
  double total = 0.0;
  for (std::size_t i = 0; i < degree; ++i) total += std::abs(control[i + 1] - control[i]);
  return total;
}

}  // namespace thermal
