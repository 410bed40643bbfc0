// What acts on a rod at one time.
#pragma once

#include "numerics/vectors.hpp"
#include "physics/data.hpp"
#include "physics/frame.hpp"

namespace rod {

struct Loads {
  Vec3 gravity;                  // m/s2
  Vec3 tip_force;                // N, fixed frame
  Vec3 tip_moment;               // N m, fixed frame
  PerTca<double> T{};            // K
  PerTca<double> delta_guess{};  // m

  /// The same with vectors in the axes of this frame.
  Loads seen_from(const Frame& frame) const;
};

inline constexpr std::size_t load_numbers = 9 + 2 * tca_count;
static_assert(sizeof(Loads) == load_numbers * sizeof(double));

/// Inputs as they are `elapsed` seconds into the step, and their rates there.
Loads loads_at(const Inputs& u, double elapsed);
Loads load_rates_at(const Inputs& u, double elapsed);

}  // namespace rod
