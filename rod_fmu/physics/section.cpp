// A section from the parameters: solid cylinder, or given stiffnesses.
#include "physics/section.hpp"

#include <numbers>

namespace rod {

Section Section::of(const Segment& segment, Profile profile, double radius) {
  const double area = std::numbers::pi * radius * radius;
  const double second_moment = area * radius * radius / 4.0;
  const double G = segment.E / (2.0 * (1.0 + segment.nu));
  const double EI = segment.E * second_moment, GJ = 2.0 * G * second_moment;
  const double EA = segment.E * area, GA = segment.shear_factor * G * area;
  const double rotary = segment.rho * second_moment;
  const std::array<double, 6> solid{EI, EI, GJ, GA, GA, EA};
  const Triple& curvature = segment.curvature;
  return {.stiffness = profile == Profile::round ? solid : segment.stiffness,
          .retardation = segment.retardation,
          .mass = segment.rho * area,
          .inertia = {rotary, rotary, 2.0 * rotary},
          .reference = {curvature[0], curvature[1], curvature[2], 0.0, 0.0, 1.0}};
}

Section Section::seen_from(const Frame& frame) const {
  Section out = *this;
  for (int first : {0, 3}) {  // in a principal plane these are the values themselves
    const double c2 = frame.cosine * frame.cosine, s2 = frame.sine * frame.sine;
    out.stiffness[first] = c2 * stiffness[first] + s2 * stiffness[first + 1];
    out.stiffness[first + 1] = s2 * stiffness[first] + c2 * stiffness[first + 1];
    const Vec3 turned = frame.to_frame(Vec3{reference[first], reference[first + 1], reference[first + 2]});
    out.reference[first] = turned.x, out.reference[first + 1] = turned.y;
  }
  return out;
}

}  // namespace rod
