// Loads of a rod at one time: weight, tip wrench, force along the rod, temperatures of the TCAs and displacements given
// to them.
#pragma once

#include "numerics/vectors.hpp"
#include "physics/data.hpp"
#include "physics/frame.hpp"

namespace rod {

/// Weight and tip wrench in the axes of some frame.
struct BodyLoads {
  Vec3 gravity;     // m/s2
  Vec3 tip_force;   // N
  Vec3 tip_moment;  // N m
};

/// Vectors are in the fixed frame.
struct Loads : BodyLoads {
  PerTca<double> T{};                       // K
  PerTca<double> delta_guess{};             // m
  std::array<Vec3, kShapeStations> load{};  // force per length at the stations [N/m]

  /// Weight and tip wrench in the axes of this frame.
  BodyLoads seen_from(const Frame& frame) const;
};

inline constexpr std::size_t kLoadCount = 9 + 2 * kMaxTcas + 3 * kShapeStations;
static_assert(sizeof(Loads) == kLoadCount * sizeof(double));

/// Inputs, and their time derivatives, `elapsed` [s] after the start of the step.
Loads loads_at(const Inputs& u, double elapsed);
Loads load_rates_at(const Inputs& u, double elapsed);
/// Whether all inputs stand still.
bool are_constant(const Inputs& u);
PerTca<double> temperatures_at(const Inputs& u, double elapsed);

}  // namespace rod
