// The host's log: which categories exist (modelDescription.xml lists the same), which are on, and the way to the
// callback.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "fmi2Functions.h"

namespace fmu {

struct Category {
  const char* name;
  fmi2Status status;
  bool on_from_start;  // even when the host did not ask for debug logging
  const char* description;
};
namespace category {
inline constexpr std::array<Category, 5> kAll{{
    {"logStatusWarning", fmi2Warning, true, "The result may be worse than expected"},
    {"logStatusDiscard", fmi2Discard, true, "A step came only part of the way: why, and what to do"},
    {"logStatusError", fmi2Error, true, "A call was refused or failed: why, and what to do"},
    {"logStatusFatal", fmi2Fatal, true, "The instance is unusable"},
    {"logEvents", fmi2OK, false, "Builds, initialisations, resets and restored states"},
}};
inline constexpr std::size_t warning = 0, discard = 1, error = 2, fatal = 3, events = 4;
inline constexpr const char* kEverything = "logAll";
}  // namespace category

class Log {
 public:
  /// `functions` may be null, and so may its logger: then nothing is logged.
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
