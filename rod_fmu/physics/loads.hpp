// Loads of a rod at one time: weight, tip wrench, temperatures of the TCAs and displacements given to them.
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

inline constexpr std::size_t kLoadCount = 9 + 2 * kTcas;
static_assert(sizeof(Loads) == kLoadCount * sizeof(double));

/// Inputs, and their time derivatives, `elapsed` [s] after the start of the step.
Loads loads_at(const Inputs& u, double elapsed);
Loads load_rates_at(const Inputs& u, double elapsed);

}  // namespace rod
