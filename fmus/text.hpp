// Numbers and lists as text: shortest digits that read back as the same double.
#pragma once

#include <array>
#include <charconv>
#include <string>
#include <string_view>

namespace fmu {

inline std::string text(double value) {
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  return {digits.data(), end};
}

/// Appends `item` to a list such as "a, b, c".
inline void append(std::string& list, std::string_view item, std::string_view separator = ", ") {
  if (!list.empty()) list += separator;
  list += item;
}

}  // namespace fmu
