// Parameters of the TCAs: law, wire, routing.
#include "fmu/shared_rows.hpp"

namespace rod {

namespace {

void add_wire(SharedRows& shared) {
  shared.tcas("tca.wire_length", &Tca::wire_length, "m", "length of the coiled wire", within(kTiny, 1e3, 0.1));
  shared.tcas("tca.wire_diameter", &Tca::wire_diameter, "m", "diameter of the wire", within(kTiny, 1e3, 1e-3));
  shared.tcas("tca.coils", &Tca::coils, "1", "number of coils", within(kTiny, 1e9, 10));
  shared.tcas("tca.twists", &Tca::twists, "1", "number of inserted twists", within(0, 1e9, 100));
  shared.tcas("tca.E", &Tca::E, "Pa", "Young's modulus of the wire", within(kTiny, kHuge, 1e9));
  shared.tcas("tca.rho_T", &Tca::rho_T, "1/K", "thermal expansion of the wire's diameter", within(-1, 1, 1e-3));
  shared.tcas("tca.chirality", &Tca::chirality, "", "+1: extends when heated, -1: contracts", within(-1, 1));
  shared.tcas("tca.handedness", &Tca::handedness, "",
              "handedness of the coil, +1 or -1: sense of its torque, used when tca.ends = tethered", within(-1, 1));
}

void add_measured(SharedRows& shared) {
  shared.tcas("tca.stiffness", &Tca::stiffness, "N/m", "stiffness of a TCA, used when tca.law = measured",
              within(0, kHuge, 10));
  shared.tcas("tca.stiffening", &Tca::stiffening, "N/m2",
              "tension per square of the extension, used when tca.law = measured", within(-kHuge, kHuge, 1e3));
  shared.tcas("tca.stroke", &Tca::stroke, "m/K", "free stroke per kelvin, used when tca.law = measured",
              within(-1, 1, 1e-4));
  shared.tcas("tca.stroke_curvature", &Tca::stroke_curvature, "m/K2",
              "free stroke per square of the temperature rise, used when tca.law = measured", within(-1, 1, 1e-6));
  shared.tcas("tca.stop", &Tca::stop, "m", "displacement at which the coils touch, used when tca.law = measured",
              within(-1e3, 1e3, 1e-3));
  shared.tcas("tca.stop_width", &Tca::stop_width, "m", "displacement over which the contact of the coils sets in",
              within(kTiny, 1e3, 1e-3));
  shared.tcas("tca.stop_stiffness", &Tca::stop_stiffness, "N/m", "stiffness of touching coils; 0: they never touch",
              within(0, kHuge, 100));
}

void add_creep_law(SharedRows& shared) {
  shared.tcas("tca.creep_compliance", &Tca::creep_compliance, "m/N",
              "creep per tension after a long time, used when tca.law = measured; 0: no creep", within(0, kHuge, 0.01));
  shared.tcas("tca.creep_time", &Tca::creep_time, "s", "retardation time of the creep at T_0", within(kTiny, 1e12, 10));
  shared.tcas("tca.creep_activation", &Tca::creep_activation, "K",
              "activation of the creep's rate: energy over the gas constant", within(-1e6, 1e6, 1e3));
}

}  // namespace

void add_tcas(Table& table, SharedRows& shared, const Parameters& p, bool has_creep) {
  fmu::Variable& offset =
      table.parameter("tca.offset", p.tca[0].offset, "m", "distance of the TCAs from the centreline, at both ends")
          .range(0, 1e3)
          .nominal(2.5e-3);
  for (std::size_t i = 0; i < p.tcas; ++i) {
    if (i > 0) table.also(offset, p.tca[i].offset);
    table.also(offset, p.tca[i].offset_end);
  }
  for (std::size_t i = 0; i < p.tcas; ++i)
    table.parameter(fmu::indexed("tca.azimuth", i), p.tca[i].azimuth, "rad", "azimuth of the TCA at the clamp")
        .range(-100 * kFullTurn, 100 * kFullTurn);
  for (std::size_t i = 0; i < p.tcas; ++i)
    table
        .parameter(fmu::indexed("tca.helix", i), p.tca[i].helix, "rad/m",
                   "rotation of the TCA's azimuth per length of the rod")
        .range(-1e5, 1e5)
        .nominal(100);
  shared.tcas("tca.law", &Tca::law, "",
              "TCA law: wire, from data of the wire (Eq. 4); measured, from tca.stiffness and tca.stroke",
              among({"wire", "measured"}));
  shared.tcas("tca.pitch", &Tca::pitch, "",
              "pitch angle of the coils: frozen, at its reference value; current, following delta",
              among({"frozen", "current"}));
  add_wire(shared);
  add_measured(shared);
  if (has_creep) add_creep_law(shared);
  table
      .parameter("tca.contact", p.contact, "",
                 "TCAs in the body: sliding in their channels, one tension each; bonded to it, a tension per section")
      .choices({"sliding", "bonded"});
  table
      .parameter("tca.ends", p.ends, "",
                 "ends of the TCAs: free to turn about the TCA; tethered, held by the body, which they twist")
      .choices({"free", "tethered"});
}

void add_routing(Table& table, const Parameters& p) {
  const int segments = static_cast<int>(p.segments);
  for (std::size_t i = 0; i < p.tcas; ++i)
    table.also(table
                   .parameter(fmu::indexed("tca.offset", i), p.tca[i].offset, "m",
                              "distance of the TCA from the centreline, at both ends of its span")
                   .range(0, 1e3)
                   .nominal(2.5e-3),
               p.tca[i].offset_end);
  for (std::size_t i = 0; i < p.tcas; ++i)
    table
        .parameter(fmu::indexed("tca.offset_end", i), p.tca[i].offset_end, "m",
                   "distance of the TCA from the centreline at the end of its span, linear between")
        .range(0, 1e3)
        .nominal(2.5e-3);
  for (std::size_t i = 0; i < p.tcas; ++i)
    table
        .parameter(fmu::indexed("tca.first_segment", i), p.tca[i].first_segment, "",
                   "first segment of the body along which the TCA lies")
        .range(1, segments);
  for (std::size_t i = 0; i < p.tcas; ++i)
    table.parameter(fmu::indexed("tca.last_segment", i), p.tca[i].last_segment, "", "last segment of the TCA's span")
        .range(1, segments);
}

}  // namespace rod
