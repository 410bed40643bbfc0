// The probe: a chain of equal masses between springs, small enough to know everything about it, with one of every kind
// of variable. It exists to try the FMI runtime, not to be physics.
#pragma once

#include <limits>

#include "model/model.hpp"

namespace probe {

enum class Scheme { midpoint = 1, classical };

inline constexpr int kMostMasses = 10;

/// Makes the model leave its output `reading` unwritten, as a model would that knows nothing of a new row.
inline bool forgets_reading = false;

struct Data {
  // parameters
  double mass = 1.0;
  double stiffness = 4.0;
  double damping = 0.1;
  int masses = 1;
  bool is_clamped = false;
  Scheme scheme = Scheme::classical;
  double tolerance = 1e-6;
  double longest_step = 1e3;
  double breaking_force = 1e3;
  // inputs
  fmu::Polynomial force{};
  fmu::Polynomial bias{};
  // outputs
  double x = 0.0, v = 0.0, reading = 0.0;
  int builds = 0;
};

}  // namespace probe
