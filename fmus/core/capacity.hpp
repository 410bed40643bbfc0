// Largest bodies that the FMUs hold: arrays have room for these, loops go to the number chosen when an FMU is written.
#pragma once

#include <cstddef>

namespace core {

inline constexpr std::size_t kMaxTcas = 12;     // twice the six of a hexapod-like body; thermal data grow as its square
inline constexpr std::size_t kMaxSegments = 6;  // of the rod, each with its own material and strain polynomials

inline constexpr std::size_t kDefaultTcas = 3;  // the paper's manipulator
inline constexpr std::size_t kDefaultSegments = 1;

}  // namespace core
