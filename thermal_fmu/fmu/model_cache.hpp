// Modal models that instances of this process have derived: the next instance with the same section takes a copy, where
// deriving one takes from milliseconds to a second.
#pragma once

#include <optional>
#include <string>

#include "physics/parameters.hpp"
#include "reduction/modal_model.hpp"

namespace thermal {

struct DerivedModel {
  Parameters parameters;
  ModalModel model;
  std::string accuracy;  // see ThermalModel
};

/// Returns what was derived for a section: all parameters but the circuit's.
std::optional<DerivedModel> find_derived(const Parameters& parameters);

/// Keeps a model, in place of the oldest one where there are kMaxDerived already.
void keep_derived(const DerivedModel& derived);

constexpr std::size_t kMaxDerived = 8;  // of up to 0.5 MB each

}  // namespace thermal
