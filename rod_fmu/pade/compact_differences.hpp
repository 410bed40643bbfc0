// Compact finite differences of 4th order on n evenly spaced points (Eq. 25; Lele, J. Comput. Phys. 103, 1992), with
// one-sided closures of the same order: sum_j a_j f'_j = sum_j b_j f_j / spacing over the points of one row,
//   inside   f'_{k-1}/4 + f'_k + f'_{k+1}/4 = 3/4 (f_{k+1} - f_{k-1})/spacing
//   at 0     f'_0 + 3 f'_1 = (-17 f_0 + 9 f_1 + 9 f_2 - f_3)/(6 spacing), mirrored at the other end;
// and integrals over one spacing, exact for cubics.
#pragma once

#include <array>

namespace rod::pade {

inline constexpr int kReach = 4;  // points of the widest row

/// Row k of the compact derivative: coefficients of f' and of f/spacing at the points first ... first + count - 1.
struct DifferenceRow {
  int first, count;
  std::array<double, kReach> slope, value;
};

inline DifferenceRow compact_row(int k, int n) {
  if (k == 0) return {0, 4, {1.0, 3.0}, {-17.0 / 6.0, 1.5, 1.5, -1.0 / 6.0}};
  if (k == n - 1) return {n - 4, 4, {0.0, 0.0, 3.0, 1.0}, {1.0 / 6.0, -1.5, -1.5, 17.0 / 6.0}};
  return {k - 1, 3, {0.25, 1.0, 0.25}, {-0.75, 0.0, 0.75}};
}

/// Integral from point k to k + 1 over the spacing: weights of the points first ... first + 3.
struct IntervalRule {
  int first;
  std::array<double, kReach> weight;
};

inline IntervalRule interval_rule(int k, int n) {
  constexpr double u = 1.0 / 24.0;
  if (k == 0) return {0, {9 * u, 19 * u, -5 * u, u}};
  if (k == n - 2) return {n - 4, {u, -5 * u, 19 * u, 9 * u}};
  return {k - 1, {-u, 13 * u, 13 * u, -u}};
}

}  // namespace rod::pade
