// Sizes that are fixed when the library is compiled.
#pragma once

#include <cstddef>

namespace rod {

inline constexpr std::size_t tca_count = TCA_COUNT;
inline constexpr std::size_t shape_stations = 21;                      // evenly spaced points of the output shape.p
inline constexpr int highest_order = 7;                                // degree of the strain polynomials
inline constexpr std::size_t strain_states = 6 * (highest_order + 1);  // coefficients of the largest rod

}  // namespace rod
