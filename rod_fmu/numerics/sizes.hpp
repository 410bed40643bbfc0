// Sizes that are fixed when the library is compiled.
#pragma once

#include <cstddef>

namespace rod {

inline constexpr std::size_t kTcas = TCA_COUNT;
inline constexpr std::size_t kShapeStations = 21;                  // evenly spaced points of the output shape.p
inline constexpr int kMaxOrder = 7;                                // degree of the strain polynomials
inline constexpr std::size_t kStrainStates = 6 * (kMaxOrder + 1);  // coefficients of the largest rod

}  // namespace rod
