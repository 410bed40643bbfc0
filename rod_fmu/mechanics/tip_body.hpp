// Rigid body at the tip of a rod: mass m, inertia J about its centre, which lies at c in the frame of the tip. Its
// weight and inertia load the tip with
//   F = m (g - a_c),   M = R c x F - d/dt (R J R^T omega),   a_c = a + alpha x R c + omega x (omega x R c).
#pragma once

#include "mechanics/loops.hpp"

namespace rod {

/// Wrench of the body on the tip [N, N m]; without inertia where the rod does not move.
Wrench tip_body_wrench(const TipBody& body, const SectionMotion& tip, const Vec3& gravity, bool moving);
/// Its derivative in the motion of the tip.
Wrench tip_body_variation(const TipBody& body, const SectionMotion& tip, const Vec3& gravity, bool moving,
                          const SectionVariation& d);
/// Kinetic energy [J], and potential of the weight [J], 0 for a mass at the clamp.
double tip_body_kinetic(const TipBody& body, const SectionMotion& tip);
double tip_body_potential(const TipBody& body, const SectionMotion& tip, const Vec3& gravity);

}  // namespace rod
