// FNV-1a, 64 bit (Fowler, Noll, Vo): names a variable table and guards serialised states against damage.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace fmu {

inline std::uint64_t hash(std::span<const std::byte> bytes, std::uint64_t seed = 0xcbf29ce484222325u) {
  for (const std::byte byte : bytes) seed = (seed ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3u;
  return seed;
}

inline std::uint64_t hash(std::string_view text, std::uint64_t seed = 0xcbf29ce484222325u) {
  return hash(std::as_bytes(std::span(text)), seed);
}

}  // namespace fmu
