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

}  // namespace rod
