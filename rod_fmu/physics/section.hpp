// Cross-section of the body (Eqs. 9-13): W = K (xi - xi*) + D dxi/dt with
//   K = diag(EI, EI, GJ, ks GA, ks GA, EA)   [N m2], [N]
//   D = (retardation time) K                 Kelvin-Voigt damping [N m2 s], [N s]
//   Gamma = rho diag(I, I, 2 I, A, A, A)     inertia per length [kg m], [kg/m].
#pragma once

#include <array>

#include "numerics/vectors.hpp"
#include "physics/data.hpp"
#include "physics/frame.hpp"

namespace rod {

/// All of it in the body frame, ordered [angular; linear].
struct Section {
  std::array<double, 6> stiffness{};                  // N m^2 (3), N (3)
  double retardation = 0.0;                           // s, damping = retardation * stiffness
  double mass = 0.0;                                  // kg/m
  Vec3 inertia;                                       // kg m, rotary inertia per length
  std::array<double, 6> reference{0, 0, 0, 0, 0, 1};  // xi*, 1/m and 1

  /// The section of a segment where the body has this radius [m].
  static Section of(const Segment& segment, Profile profile, double radius);
  /// The section of a body of one segment, at the clamp.
  static Section of(const Parameters& p) { return of(p.segment[0], p.profile, p.segment[0].radius); }
  /// The same section with components in this frame.
  Section seen_from(const Frame& frame) const;
};

}  // namespace rod
