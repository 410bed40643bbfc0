// Orientation along the rod from its curvature, R' = R kappa^ (Eq. 5): in space by a Magnus expansion of order 6
// between neighbouring nodes (Blanes, Casas, Ros, BIT Numer. Math. 40, 2000), in a plane from its angle.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "numerics/field.hpp"
#include "numerics/quadrature.hpp"
#include "physics/data.hpp"

namespace rod {

/// Curvature times L at the Gauss points of every interval: [point][component].
using IntervalCurvature = std::array<std::array<IntervalField, 3>, kGaussPoints>;

/// Writes R at the nodes and returns the unit quaternion of the tip, scalar part first.
std::array<double, 4> rotate_along(const Quadrature& grid, const IntervalCurvature& kappa, RotationField& R);

/// Writes cos(t) and sin(t)/t for t^2 = square. Ten terms of their series reach rounding error for square <= 1.
ROD_INLINE void cosine_and_sinc(const Pack& square, Pack& cosine, Pack& sinc) {
  cosine = sinc = 1.0 - Pack{};
  for (int n = 9; n > 0; --n) {
    cosine = 1.0 - cosine * square * (1.0 / ((2 * n - 1) * (2 * n)));
    sinc = 1.0 - sinc * square * (1.0 / ((2 * n) * (2 * n + 1)));
  }
}

/// Writes the rotations about y by these angles [rad]: series for a quarter of each angle, doubled twice; library
/// functions where a quarter exceeds one radian.
template <int packs>
ROD_INLINE void rotate_in_plane(const ScalarField& angle, RotationField& R) {
  ScalarField cosine, sine;
  Pack largest = {};
  for (int p = 0; p < packs; ++p) {
    const Pack t = 0.25 * angle.pack[p], square = t * t;
    Pack c, sinc;
    cosine_and_sinc(square, c, sinc);
    const Pack s = t * sinc, c2 = 1.0 - 2.0 * s * s, s2 = 2.0 * s * c;
    cosine.pack[p] = 1.0 - 2.0 * s2 * s2, sine.pack[p] = 2.0 * s2 * c2;
    largest = square > largest ? square : largest;
  }
  if (!(std::max(std::max(largest[0], largest[1]), std::max(largest[2], largest[3])) <= 1.0))
    for (int k = 0; k < packs * kPackSize; ++k) cosine[k] = std::cos(angle[k]), sine[k] = std::sin(angle[k]);
  for (int p = 0; p < packs; ++p) {
    R.row0.x.pack[p] = R.row2.z.pack[p] = cosine.pack[p];
    R.row0.z.pack[p] = sine.pack[p], R.row2.x.pack[p] = -sine.pack[p];
    R.row1.y.pack[p] = 1.0 - Pack{};
  }
}

/// Angles [rad] of R = Rx(alpha) Ry(beta) Rz(gamma). At beta = +-90 degrees only alpha +- gamma is defined; gamma is
/// then 0.
Triple euler_angles(const Rotation<double>& R);

}  // namespace rod
