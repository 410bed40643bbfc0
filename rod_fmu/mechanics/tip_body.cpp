// Newton-Euler equations of the body at the tip.
#include "mechanics/tip_body.hpp"

namespace rod {

namespace {

Vec3 vector(const Triple& a) { return {a[0], a[1], a[2]}; }

/// Spin of the tip in its own frame, and the time derivative of that.
struct Spin {
  Vec3 omega, alpha;
};

Vec3 angular_momentum_rate(const Vec3& J, const Spin& spin) {  // in the frame of the tip
  return scale(J, spin.alpha) + cross(spin.omega, scale(J, spin.omega));
}

}  // namespace

Wrench tip_body_wrench(const TipBody& body, const SectionMotion& tip, const Vec3& gravity, bool moving) {
  const Vec3 arm = tip.R * vector(body.centre);
  if (!moving) return {body.mass * gravity, cross(arm, body.mass * gravity)};
  const Vec3 acceleration = tip.a + cross(tip.alpha, arm) + cross(tip.omega, cross(tip.omega, arm));
  const Vec3 force = body.mass * (gravity - acceleration);
  const Spin spin{transpose_times(tip.R, tip.omega), transpose_times(tip.R, tip.alpha)};
  return {force, cross(arm, force) - tip.R * angular_momentum_rate(vector(body.inertia), spin)};
}

Wrench tip_body_variation(const TipBody& body, const SectionMotion& tip, const Vec3& gravity, bool moving,
                          const SectionVariation& d) {
  const Vec3 arm = tip.R * vector(body.centre), d_arm = cross(d.theta, arm);
  if (!moving) return {{}, cross(d_arm, body.mass * gravity)};
  const Vec3 force = tip_body_wrench(body, tip, gravity, true).force;
  const Vec3 d_acceleration = d.a + cross(d.alpha, arm) + cross(tip.alpha, d_arm) +
                              cross(d.omega, cross(tip.omega, arm)) +
                              cross(tip.omega, cross(d.omega, arm) + cross(tip.omega, d_arm));
  const Vec3 d_force = -body.mass * d_acceleration;
  const Vec3 J = vector(body.inertia);
  const Spin spin{transpose_times(tip.R, tip.omega), transpose_times(tip.R, tip.alpha)};
  const Vec3 d_omega = transpose_times(tip.R, d.omega - cross(d.theta, tip.omega));
  const Vec3 d_alpha = transpose_times(tip.R, d.alpha - cross(d.theta, tip.alpha));
  const Vec3 d_rate = scale(J, d_alpha) + cross(d_omega, scale(J, spin.omega)) + cross(spin.omega, scale(J, d_omega));
  return {d_force, cross(d_arm, force) + cross(arm, d_force) - cross(d.theta, tip.R * angular_momentum_rate(J, spin)) -
                       tip.R * d_rate};
}

double tip_body_kinetic(const TipBody& body, const SectionMotion& tip) {
  const Vec3 velocity = tip.v + cross(tip.omega, tip.R * vector(body.centre));
  const Vec3 spin = transpose_times(tip.R, tip.omega);
  return 0.5 * (body.mass * dot(velocity, velocity) + dot(spin, scale(vector(body.inertia), spin)));
}

double tip_body_potential(const TipBody& body, const SectionMotion& tip, const Vec3& gravity) {
  return -body.mass * dot(gravity, tip.p + tip.R * vector(body.centre));
}

}  // namespace rod
