// The host's log: which categories are switched on, and the call of the host's logger.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "description/log_categories.hpp"
#include "fmi2Functions.h"

namespace fmu {

class Log {
 public:
  /// `functions` may be null, and so may its logger: then nothing is logged. debug: loggingOn of fmi2Instantiate, for
  /// all categories.
  Log(std::string instance, const fmi2CallbackFunctions* functions, bool debug);

  bool is_on(std::size_t category) const { return logger_ && on_[category]; }

  /// Never throws: it is the last thing that is called when everything else failed.
  void write(std::size_t category, std::string_view message) const noexcept;

  /// Turns the named categories, or all when none is named, on or off. Throws Error on an unknown name, changing
  /// nothing.
  void enable(bool on, std::span<const fmi2String> names);

 private:
  std::string instance_;
  fmi2CallbackLogger logger_ = nullptr;
  fmi2ComponentEnvironment environment_ = nullptr;
  std::array<bool, category::kAll.size()> on_{};
};

}  // namespace fmu
