// Parameters of the body: section, segments, the rigid body at the tip.
#include <string>

#include "fmu/shared_rows.hpp"

namespace rod {

namespace {

const char* stiffness_kind(std::size_t c) {
  if (c < 2) return "bending about ";
  if (c == 2) return "torsion about ";
  return c < 5 ? "shear along " : "stretch along ";
}

}  // namespace

void add_body(Table& table, SharedRows& shared, const Parameters& p) {
  fmu::Variable& radius =
      table.parameter("body.radius", p.segment[0].radius, "m", "radius of the body").range(kTiny, 1e3).nominal(5e-3);
  for (std::size_t j = 0; j < p.segments; ++j) {
    if (j > 0) table.also(radius, p.segment[j].radius);
    table.also(radius, p.segment[j].radius_end);
  }
  fmu::Variable& length =
      table.parameter("body.length", p.segment[0].length, "m", "length of the body").range(kTiny, 1e3).nominal(0.04);
  length.start = p.length();
  length.share = 1.0 / static_cast<double>(p.segments);
  for (std::size_t j = 1; j < p.segments; ++j) table.also(length, p.segment[j].length);
  shared.segments("body.E", "segment.E", &Segment::E, "Pa", "Young's modulus of the body", within(kTiny, kHuge, 4e4));
  shared.segments("body.nu", "segment.nu", &Segment::nu, "1", "Poisson's ratio of the body", within(-0.999, 0.5));
  shared.segments("body.rho", "segment.rho", &Segment::rho, "kg/m3", "density of the body", within(kTiny, 1e9, 1e3));
  shared.segments("body.shear_factor", "segment.shear_factor", &Segment::shear_factor, "1", "shear correction factor",
                  within(kTiny, 1e6));
  shared.segments("body.retardation", "segment.retardation", &Segment::retardation, "s",
                  "Kelvin-Voigt retardation time: damping over stiffness of the body; 0: undamped",
                  within(0, 1e6, 5e-3));
  table
      .parameter("body.profile", p.profile, "",
                 "stiffness of the section: round, of a solid cylinder; given, by body.stiffness")
      .choices({"round", "given"});
  for (std::size_t c = 0; c < 6; ++c) {
    fmu::Variable& row =
        table
            .parameter(fmu::indexed("body.stiffness", c), p.segment[0].stiffness[c], c < 3 ? "N.m2" : "N",
                       std::string("stiffness of the section in ") + stiffness_kind(c) + kAxes[c % 3] +
                           ", used when body.profile = given")
            .range(kTiny, kHuge);
    for (std::size_t j = 1; j < p.segments; ++j) table.also(row, p.segment[j].stiffness[c]);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    fmu::Variable& row = table
                             .parameter(fmu::indexed("body.curvature", c), p.segment[0].curvature[c], "1/m",
                                        std::string("curvature of the unloaded body about ") + kAxes[c])
                             .range(-1e6, 1e6)
                             .nominal(10);
    for (std::size_t j = 1; j < p.segments; ++j) table.also(row, p.segment[j].curvature[c]);
  }
}

void add_segments(Table& table, const Parameters& p) {
  for (std::size_t j = 0; j < p.segments; ++j) {
    table.parameter(element("segment.radius", j, 0), p.segment[j].radius, "m", "radius at the start of the segment")
        .range(kTiny, 1e3)
        .nominal(5e-3);
    table.parameter(element("segment.radius", j, 1), p.segment[j].radius_end, "m", "radius at its end, linear between")
        .range(kTiny, 1e3)
        .nominal(5e-3);
  }
  for (std::size_t j = 0; j < p.segments; ++j)
    table.parameter(fmu::indexed("segment.length", j), p.segment[j].length, "m", "length of the segment")
        .range(kTiny, 1e3)
        .nominal(0.04);
  if (p.segments == 1) return;  // body.stiffness and body.curvature are those of the only segment
  for (std::size_t j = 0; j < p.segments; ++j)
    for (std::size_t c = 0; c < 6; ++c)
      table
          .parameter(element("segment.stiffness", j, c), p.segment[j].stiffness[c], c < 3 ? "N.m2" : "N",
                     std::string("stiffness of the section in ") + stiffness_kind(c) + kAxes[c % 3] +
                         ", used when body.profile = given")
          .range(kTiny, kHuge);
  for (std::size_t j = 0; j < p.segments; ++j)
    for (std::size_t c = 0; c < 3; ++c)
      table
          .parameter(element("segment.curvature", j, c), p.segment[j].curvature[c], "1/m",
                     std::string("curvature of the unloaded segment about ") + kAxes[c])
          .range(-1e6, 1e6)
          .nominal(10);
}

void add_tip_body(Table& table, const Parameters& p) {
  table.parameter("tip_body.mass", p.tip_body.mass, "kg", "mass of the rigid body at the tip; 0: none")
      .range(0, 1e6)
      .nominal(1e-3);
  for (std::size_t c = 0; c < 3; ++c)
    table
        .parameter(
            fmu::indexed("tip_body.inertia", c), p.tip_body.inertia[c], "kg.m2",
            std::string("moment of inertia of the body at the tip about its centre, axis ") + kAxes[c] + " of the tip")
        .range(0, 1e6)
        .nominal(1e-7);
  for (std::size_t c = 0; c < 3; ++c)
    table
        .parameter(
            fmu::indexed("tip_body.centre", c), p.tip_body.centre[c], "m",
            std::string("centre of mass of the body at the tip, from the tip, along ") + kAxes[c] + " of the tip")
        .range(-1e3, 1e3)
        .nominal(1e-3);
}

}  // namespace rod
