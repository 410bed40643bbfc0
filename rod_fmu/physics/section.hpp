// The body's cross-section: stiffness, damping, inertia and unloaded strains.
#pragma once

#include <array>

#include "numerics/vectors.hpp"
#include "physics/data.hpp"
#include "physics/frame.hpp"

namespace rod {

/// Cross-section, body frame, [angular; linear] as everywhere.
struct Section {
  std::array<double, 6> stiffness{};                  // N m^2 (3), N (3)
  double retardation = 0.0;                           // s, damping = retardation * stiffness
  double mass = 0.0;                                  // kg/m
  Vec3 inertia;                                       // kg m, rotary inertia per length
  std::array<double, 6> reference{0, 0, 0, 0, 0, 1};  // xi*, 1/m and 1

  static Section of(const Parameters& p);
  /// The same with the axes of this frame.
  Section seen_from(const Frame& frame) const;
};

}  // namespace rod
