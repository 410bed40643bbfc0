// Magnus expansion of order 6 of R' = R kappa^ (Eq. 5), all intervals between nodes at once.
#include "mechanics/rotations.hpp"

#include <cmath>

#include "numerics/kernel.hpp"

namespace rod {

namespace {

using Quaternions = std::array<IntervalField, 4>;

/// Half the rotation vector over an interval of length h from the curvature at its three Gauss points. The bracket of
/// R' = R kappa^ is [a, b] = b x a.
template <Number T>
ROD_INLINE Triad<T> half_rotation_vector(const T& h, const Triad<T>& k1, const Triad<T>& k2, const Triad<T>& k3) {
  const Triad<T> a1 = h * k2;
  const Triad<T> a2 = (std::sqrt(15.0) / 3.0) * h * (k3 - k1);
  const Triad<T> a3 = (10.0 / 3.0) * h * (k3 - 2.0 * k2 + k1);
  const Triad<T> c1 = cross(a2, a1);
  const Triad<T> c2 = (-1.0 / 60.0) * cross(2.0 * a3 + c1, a1);
  return 0.5 * (a1 + (1.0 / 12.0) * a3 + (1.0 / 240.0) * cross(a2 + c2, -20.0 * a1 - a3 + c1));
}

/// Writes the rotations over all intervals. Returns the largest half angle squared; beyond 1 the series is inaccurate.
ROD_INLINE double interval_rotations(const Quadrature& grid, const IntervalCurvature& kappa, Quaternions& rotations) {
  Pack largest = {};
  const auto at = [&kappa](int g, int p) ROD_LAMBDA_INLINE {
    return Triad<Pack>{kappa[g][0].pack[p], kappa[g][1].pack[p], kappa[g][2].pack[p]};
  };
  for (int p = 0; p < grid.interval_packs; ++p) {
    const Triad<Pack> half = half_rotation_vector(grid.length.pack[p], at(0, p), at(1, p), at(2, p));
    const Pack square = dot(half, half);
    Pack sinc;
    cosine_and_sinc(square, rotations[0].pack[p], sinc);
    rotations[1].pack[p] = sinc * half.x, rotations[2].pack[p] = sinc * half.y, rotations[3].pack[p] = sinc * half.z;
    largest = square > largest ? square : largest;
  }
  return std::max(std::max(largest[0], largest[1]), std::max(largest[2], largest[3]));
}

/// The same for rotations of any angle.
void large_interval_rotations(const Quadrature& grid, const IntervalCurvature& kappa, Quaternions& rotations) {
  for (int e = 0; e < grid.intervals; ++e) {
    const auto at = [&kappa, e](int g) { return Vec3{kappa[g][0][e], kappa[g][1][e], kappa[g][2][e]}; };
    const Vec3 half = half_rotation_vector(grid.length[e], at(0), at(1), at(2));
    const double angle = std::sqrt(dot(half, half));
    const double sinc = angle > 1e-4 ? std::sin(angle) / angle : 1.0 - angle * angle / 6.0;
    rotations[0][e] = std::cos(angle);
    rotations[1][e] = sinc * half.x, rotations[2][e] = sinc * half.y, rotations[3][e] = sinc * half.z;
  }
}

ROD_INLINE void matrices(int packs, const std::array<ScalarField, 4>& q, RotationField& R) {
  for (int p = 0; p < packs; ++p) R.set(p, rotation(q[0].pack[p], q[1].pack[p], q[2].pack[p], q[3].pack[p]));
}

}  // namespace

std::array<double, 4> rotate_along(const Quadrature& grid, const IntervalCurvature& kappa, RotationField& R) {
  Quaternions rotations;
  if (!(dispatch<interval_rotations>(grid, kappa, rotations) <= 1.0)) large_interval_rotations(grid, kappa, rotations);

  std::array<ScalarField, 4> at_nodes;
  double w = 1.0, x = 0.0, y = 0.0, z = 0.0;
  for (int e = 0; e < grid.intervals; ++e) {
    const double a = rotations[0][e], b = rotations[1][e], c = rotations[2][e], d = rotations[3][e];
    const double w1 = w * a - x * b - y * c - z * d, x1 = w * b + x * a + y * d - z * c;
    const double y1 = w * c - x * d + y * a + z * b, z1 = w * d + x * c - y * b + z * a;
    w = w1, x = x1, y = y1, z = z1;
    const int k = e / grid.pieces;
    if (k < grid.nodes && e % grid.pieces == grid.pieces - 1)
      at_nodes[0][k] = w, at_nodes[1][k] = x, at_nodes[2][k] = y, at_nodes[3][k] = z;
  }
  dispatch<matrices>(grid.packs, at_nodes, R);
  const double norm = std::sqrt(w * w + x * x + y * y + z * z);
  return {w / norm, x / norm, y / norm, z / norm};
}

}  // namespace rod
