// A section from the parameters: solid cylinder, or given stiffnesses.
#include "physics/section.hpp"

#include <numbers>

namespace rod {

Section Section::of(const Parameters& p) {
  const double area = std::numbers::pi * p.body_radius * p.body_radius;
  const double second_moment = area * p.body_radius * p.body_radius / 4.0;
  const double G = p.body_E / (2.0 * (1.0 + p.body_nu));
  const double EI = p.body_E * second_moment, GJ = 2.0 * G * second_moment;
  const double EA = p.body_E * area, GA = p.body_shear_factor * G * area;
  const double rotary = p.body_rho * second_moment;
  const std::array<double, 6> solid{EI, EI, GJ, GA, GA, EA};
  const Triple& curvature = p.body_curvature;
  return {.stiffness = p.body_profile == Profile::round ? solid : p.body_stiffness,
          .retardation = p.body_retardation,
          .mass = p.body_rho * area,
          .inertia = {rotary, rotary, 2.0 * rotary},
          .reference = {curvature[0], curvature[1], curvature[2], 0.0, 0.0, 1.0}};
}

Section Section::seen_from(const Frame& frame) const {
  Section out = *this;
  for (int first : {0, 3}) {  // in a principal plane these are the values themselves
    const double c2 = frame.cosine * frame.cosine, s2 = frame.sine * frame.sine;
    out.stiffness[first] = c2 * stiffness[first] + s2 * stiffness[first + 1];
    out.stiffness[first + 1] = s2 * stiffness[first] + c2 * stiffness[first + 1];
    const Vec3 legendre_integral = frame.to_frame(Vec3{reference[first], reference[first + 1], reference[first + 2]});
    out.reference[first] = legendre_integral.x, out.reference[first + 1] = legendre_integral.y;
  }
  return out;
}

}  // namespace rod
