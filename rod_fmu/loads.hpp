// What acts on a rod at one time.
#pragma once

#include "data.hpp"
#include "field.hpp"

namespace rod {

struct Loads {
  Vec3 gravity;                  // m/s2
  Vec3 tip_force;                // N, fixed frame
  Vec3 tip_moment;               // N m, fixed frame
  PerTca<double> T{};            // K
  PerTca<double> delta_guess{};  // m
};

/// Inputs as they are `elapsed` seconds into the step, and their rates there.
Loads loads_at(const Inputs& u, double elapsed);
Loads load_rates_at(const Inputs& u, double elapsed);

}  // namespace rod
