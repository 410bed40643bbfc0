// The functions of exponential integration: phi_0(z) = e^z, phi_{j+1}(z) = (phi_j(z) - 1/j!)/z, for z <= 0.
// A mode z' = -a z + w(t) with polynomial w is stepped exactly by
//     z(h) = phi_0(-a h) z(0) + sum_j h^(j+1) phi_{j+1}(-a h) w^(j)(0).
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace thermal {

/// phi_0(-x) .. phi_count(-x), x >= 0, to a few ulps of phi_j(0) = 1/j!.
template <std::size_t count>
std::array<double, count + 1> phi(double x) {
  std::array<double, count + 1> result{};
  result[0] = std::exp(-x);
  if (x >= 2.0) {
    // Upwards: every step divides the error by x.
    double inverse_factorial = 1.0;
    for (std::size_t j = 0; j < count; ++j) {
      result[j + 1] = (inverse_factorial - result[j]) / x;
      inverse_factorial /= static_cast<double>(j + 1);
    }
    return result;
  }
  // The highest from phi_n(-x) = e^(-x)/n! sum_m n/(n + m) x^m/m!, free of cancellation; then downwards.
  double inverse_factorial = 1.0;
  for (std::size_t j = 2; j <= count; ++j) inverse_factorial /= static_cast<double>(j);
  double sum = 1.0, power = 1.0;
  for (int m = 1; m < 40; ++m) {
    power *= x / m;
    const double term = power * count / (count + m);
    sum += term;
    if (term < 1e-17 * sum) break;
  }
  result[count] = result[0] * inverse_factorial * sum;
  for (std::size_t j = count - 1; j > 0; --j) {
    inverse_factorial *= static_cast<double>(j + 1);
    result[j] = inverse_factorial - x * result[j + 1];
  }
  return result;
}

}  // namespace thermal
