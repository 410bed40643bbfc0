// The value of an output that no model has written.
#pragma once

#include <bit>
#include <cstdint>

namespace core {

/// Not a number, and none that arithmetic makes.
inline constexpr auto kUnwritten = std::bit_cast<double>(std::uint64_t{0x7ff8'7463'615f'6e6f});

/// Whether a value is still kUnwritten.
inline bool is_unwritten(double value) {
  return std::bit_cast<std::uint64_t>(value) == std::bit_cast<std::uint64_t>(kUnwritten);
}

}  // namespace core
