// Messages put together from words and numbers.
#pragma once

#include <sstream>
#include <string>

#include "core/status.hpp"

namespace rod {

/// The parts one after the other, numbers with six digits.
template <class... Parts>
std::string message(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return text.str();
}

/// An error with the parts as its message.
template <class... Parts>
core::Status refuse(const Parts&... parts) {
  return core::Status::error(message(parts...));
}

}  // namespace rod
