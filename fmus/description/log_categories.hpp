// Log categories of the FMUs; modelDescription.xml lists the same (FMI 2.0.4, section 2.2.4).
#pragma once

#include <array>
#include <cstddef>

#include "fmi2Functions.h"

namespace fmu {

struct Category {
  const char* name;
  fmi2Status status;
  const char* description;
};
namespace category {
inline constexpr std::array<Category, 5> kAll{{
    {"logStatusWarning", fmi2Warning, "The result may be worse than expected"},
    {"logStatusDiscard", fmi2Discard, "A step came only part of the way: why, and what to do"},
    {"logStatusError", fmi2Error, "A call was refused or failed: why, and what to do"},
    {"logStatusFatal", fmi2Fatal, "The instance is unusable"},
    {"logEvents", fmi2OK, "Builds, initialisations, resets and restored states"},
}};
inline constexpr std::size_t warning = 0, discard = 1, error = 2, fatal = 3, events = 4;
inline constexpr const char* kEverything = "logAll";
}  // namespace category

}  // namespace fmu
