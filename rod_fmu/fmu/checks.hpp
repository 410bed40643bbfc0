// Checks of parameters across rows of the table, and of loads that only some parameters allow.
#pragma once

#include "core/status.hpp"
#include "physics/data.hpp"
#include "physics/loads.hpp"

namespace rod {

/// Fails where parameters contradict each other.
core::Status check(const Parameters& p);

/// Fails where a TCA's law has no meaning at a temperature.
core::Status check_temperatures(const Parameters& p, const PerTca<double>& T);

}  // namespace rod
