// Largest sizes; the number of TCAs and of segments is data of each rod.
#pragma once

#include <cstddef>

#include "core/capacity.hpp"

namespace rod {

using core::kMaxSegments;
using core::kMaxTcas;
inline constexpr std::size_t kShapeStations = 21;                  // evenly spaced points of the output shape.p
inline constexpr int kMaxOrder = 7;                                // degree of the strain polynomials
inline constexpr std::size_t kStrainStates = 6 * (kMaxOrder + 1);  // coefficients of the largest segment

}  // namespace rod
