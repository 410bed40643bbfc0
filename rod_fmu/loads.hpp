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

inline constexpr std::size_t load_numbers = 9 + 2 * tca_count;
static_assert(sizeof(Loads) == load_numbers * sizeof(double));

/// A frame turned about the rod's axis.
struct Frame {
  double cosine = 1.0, sine = 0.0;
  Vec3 in(const Vec3& a) const { return {cosine * a.x + sine * a.y, cosine * a.y - sine * a.x, a.z}; }
  Vec3 out(const Vec3& a) const { return {cosine * a.x - sine * a.y, cosine * a.y + sine * a.x, a.z}; }
  Loads in(const Loads& loads) const;
};

/// Inputs as they are `elapsed` seconds into the step, and their rates there.
Loads loads_at(const Inputs& u, double elapsed);
Loads load_rates_at(const Inputs& u, double elapsed);

}  // namespace rod
