// Orientation along the rod from its curvature: R' = R kappa^, by a Magnus expansion of order 6 between neighbouring
// nodes (Blanes, Casas, Ros, BIT Numer. Math. 40, 2000).
#pragma once

#include <array>

#include "field.hpp"
#include "quadrature.hpp"

namespace rod {

/// Curvature times L at the Gauss points of every interval, by component.
using IntervalCurvature = std::array<std::array<IntervalLane, 3>, points>;

/// Writes R at the nodes and returns the tip's unit quaternion, scalar part first.
std::array<double, 4> rotate_along(const IntervalCurvature& kappa, RotationField& R);

/// Angles of R = Rx(alpha) Ry(beta) Rz(gamma). At beta = +-90 degrees only alpha +- gamma is defined; gamma is then 0.
Triple euler_angles(const Rotation<double>& R);

}  // namespace rod
