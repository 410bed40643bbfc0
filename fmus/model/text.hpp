// Numbers and lists as text: shortest digits that read back as the same double. Text as XML and HTML want it.
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

/// The text with the characters that XML and HTML reserve written as entities.
inline std::string escaped(std::string_view plain) {
  std::string result;
  for (const char c : plain) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

}  // namespace fmu
