// The variable table of rod.fmu: one row per variable.
#include "model/table.hpp"

#include <algorithm>
#include <functional>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include "fmu/rod_model.hpp"
#include "model/model.hpp"
#include "physics/data.hpp"

namespace {

constexpr double kTiny = 1e-12;  // least value of a quantity that must be positive, in its SI unit
constexpr double kHuge = 1e30;
constexpr double kFullTurn = 6.283185307179586;
constexpr const char* kAxes[3] = {"x", "y", "z"};

const char* stiffness_kind(std::size_t c) {
  if (c < 2) return "bending about ";
  if (c == 2) return "torsion about ";
  return c < 5 ? "shear along " : "stretch along ";
}

/// "name[2,1]": the structured name of an element of a matrix, indices from 0.
std::string element(const std::string& name, std::size_t row, std::size_t column) {
  return name + "[" + std::to_string(row + 1) + "," + std::to_string(column + 1) + "]";
}

using Table = fmu::Table<rod::Data>;
using rod::Parameters;
using rod::Segment;
using rod::Tca;

/// Declares a parameter of every segment or TCA under two names: `all` sets it everywhere, `each`[i] in one place. A
/// parameter that is declared later overrides what an earlier one set, so all rows of the first kind come first.
class Shared {
 public:
  Shared(Table& table, const Parameters& p) : table_(table), p_(p) {}

  template <class Member, class Refine>
  void segments(const std::string& all, const std::string& each, Member Segment::*member, const std::string& unit,
                const std::string& description, Refine refine) {
    add(std::span(p_.segment).first(p_.segments), all, each, member, unit, description, refine);
  }
  template <class Member, class Refine>
  void tcas(const std::string& name, Member Tca::*member, const std::string& unit, const std::string& description,
            Refine refine) {
    add(std::span(p_.tca).first(p_.tcas), name, name, member, unit, description, refine);
  }
  /// Declares the rows of the second kind.
  void write_elements() {
    for (const auto& write : elements_) write();
  }

 private:
  template <class Owner, class Member, class Refine>
  void add(std::span<const Owner> owners, const std::string& all, const std::string& each, Member Owner::*member,
           const std::string& unit, const std::string& description, Refine refine) {
    fmu::Variable& row = table_.parameter(all, owners[0].*member, unit, description);
    refine(row);
    for (const Owner& other : owners.subspan(1)) table_.also(row, other.*member);
    elements_.push_back([=, this] {
      for (std::size_t i = 0; i < owners.size(); ++i)
        refine(table_.parameter(fmu::indexed(each, i), owners[i].*member, unit, description));
    });
  }

  Table& table_;
  const Parameters& p_;
  std::vector<std::function<void()>> elements_;
};

/// Refinements of a row, for Shared.
auto within(double least, double most, double nominal = 1.0) {
  return [=](fmu::Variable& row) { row.range(least, most).nominal(nominal); };
}
auto among(std::vector<std::string> items) {
  return [=](fmu::Variable& row) { row.choices(items); };
}

void add_body(Table& table, Shared& shared, const Parameters& p) {
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

/// Rows of single segments whose names have two indices, or whose row for all segments is special.
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

void add_wire(Shared& shared) {
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

void add_measured(Shared& shared) {
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

void add_tcas(Table& table, Shared& shared, const Parameters& p) {
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
  table
      .parameter("tca.contact", p.contact, "",
                 "TCAs in the body: sliding in their channels, one tension each; bonded to it, a tension per section")
      .choices({"sliding", "bonded"});
  table
      .parameter("tca.ends", p.ends, "",
                 "ends of the TCAs: free to turn about the TCA; tethered, held by the body, which they twist")
      .choices({"free", "tethered"});
}

/// Rows of single TCAs that have no row for all, or a special one.
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

void add_parameters(Table& table, const Parameters& p) {
  Shared shared(table, p);
  add_body(table, shared, p);
  add_tcas(table, shared, p);
  table.parameter("T_0", p.T_0, "K", "temperature of zero free stroke").range(1, 1e5).nominal(300);
  table
      .parameter("closure", p.closure, "",
                 "displacements that the TCA forces follow: inside, those of the rod (Eq. 17); exchanged, delta_guess")
      .choices({"inside", "exchanged"});
  shared.segments("strains", "segment.strains", &Segment::strains, "",
                  "strains of the rod; each choice contains those before it",
                  among({"bending", "extensible", "kirchhoff", "cosserat"}));
  table.parameter("planar", p.planar, "",
                  "true: motion in one plane through the axis; forces across it are left out, see out_of_plane");
  table.parameter("plane", p.plane, "rad", "azimuth of the plane of motion from the x axis, used when planar = true")
      .range(-100 * kFullTurn, 100 * kFullTurn);
  shared.segments("order", "segment.order", &Segment::order, "", "degree of the strain polynomials",
                  within(0, rod::kMaxOrder));
  table.parameter("grid_points", p.grid_points, "", "grid points along the rod, used when method = pade_euler")
      .range(rod::kMinGridPoints, rod::kMaxGridPoints);
  table.parameter("dynamic", p.dynamic, "",
                  "true: with inertia and damping; false: the shape is the equilibrium of the loads");
  table.parameter("start_at_equilibrium", p.start_at_equilibrium, "",
                  "true: starts at the equilibrium of the loads; false: starts unloaded and at rest");
  table.parameter("method", p.method, "", "time integrator, used when dynamic = true")
      .choices({"backward_euler", "rosenbrock", "midpoint", "bdf", "pade_euler", "rosenbrock_3"});
  table.parameter("tolerance", p.tolerance, "1", "relative error of one time step")
      .range(1e-13, 1e-1)
      .nominal(1e-6)
      .tunable();
  add_tip_body(table, p);
  add_segments(table, p);
  add_routing(table, p);
  shared.write_elements();
}

void add_inputs(Table& table, const rod::Inputs& u) {
  for (std::size_t i = 0; i < u.tcas; ++i)
    table.input(fmu::indexed("T", i), u.T[i], "K", "mean temperature of the TCA").range(0, 1e5).nominal(300);
  for (std::size_t i = 0; i < u.tcas; ++i)
    table
        .input(fmu::indexed("delta_guess", i), u.delta_guess[i], "m",
               "displacement of the TCA, used when closure = exchanged")
        .nominal(1e-3);
  for (std::size_t c = 0; c < 3; ++c)
    table.input(fmu::indexed("gravity", c), u.gravity[c], "m/s2", std::string("gravity along ") + kAxes[c]).nominal(10);
  for (std::size_t c = 0; c < 3; ++c)
    table.input(fmu::indexed("tip_force", c), u.tip_force[c], "N", std::string("force on the tip along ") + kAxes[c])
        .nominal(0.01);
  for (std::size_t c = 0; c < 3; ++c)
    table
        .input(fmu::indexed("tip_moment", c), u.tip_moment[c], "N.m",
               std::string("moment on the tip about ") + kAxes[c])
        .nominal(1e-4);
}

void add_outputs(Table& table, const rod::Outputs& y, std::size_t tcas) {
  for (std::size_t i = 0; i < tcas; ++i)
    table.output(fmu::indexed("delta", i), y.delta[i], y.delta_rate[i], "m", "displacement of the TCA")
        .nominal(1e-3)
        .depends({"strain"});
  for (std::size_t i = 0; i < tcas; ++i)
    table.output(fmu::indexed("N", i), y.N[i], "N", "tension of the TCA")
        .nominal(0.1)
        .depends({fmu::indexed("T", i), fmu::indexed("delta_guess", i), "strain"});
  for (std::size_t c = 0; c < 3; ++c)
    table.output(fmu::indexed("tip.p", c), y.tip_p[c], "m", std::string("tip position, ") + kAxes[c])
        .nominal(0.01)
        .depends({"strain"});
  constexpr const char* angle[3] = {"alpha", "beta", "gamma"};
  for (std::size_t c = 0; c < 3; ++c)
    table
        .output(fmu::indexed("tip.euler", c), y.tip_euler[c], "rad",
                std::string(angle[c]) + " of the tip's rotation Rx(alpha) Ry(beta) Rz(gamma)")
        .depends({"strain"});
  for (std::size_t c = 0; c < 4; ++c)
    table.output(fmu::indexed("tip.quaternion", c), y.tip_quaternion[c], "1", "tip orientation, scalar part first")
        .depends({"strain"});
  for (std::size_t c = 0; c < 3; ++c)
    table.output(fmu::indexed("tip.v", c), y.tip_v[c], "m/s", std::string("tip velocity, ") + kAxes[c])
        .nominal(0.1)
        .depends({"strain", "strain_rate"});
  table.output("energy.elastic", y.energy_elastic, "J", "strain energy of the body").nominal(1e-4).depends({"strain"});
  table
      .output("energy.tca", y.energy_tca, "J",
              "energy of the TCAs, the potential of N in delta; in delta_guess when closure = exchanged")
      .nominal(1e-4)
      .depends({"T", "delta_guess", "strain"});
  table.output("energy.kinetic", y.energy_kinetic, "J", "kinetic energy")
      .nominal(1e-4)
      .depends({"strain", "strain_rate"});
  table.output("energy.gravity", y.energy_gravity, "J", "gravitational potential, 0 for all mass at the clamp")
      .nominal(1e-4)
      .depends({"gravity", "strain"});
  table.output("energy.dissipated", y.energy_dissipated, "J", "energy dissipated by the damping since the start")
      .nominal(1e-4)
      .depends({"dissipation"});
  table
      .output("out_of_plane", y.out_of_plane, "1",
              "largest strain that the neglected forces across the plane would cause; 0 when planar = false")
      .nominal(1e-3)
      .depends({"strain", "T", "delta_guess", "gravity", "tip_force", "tip_moment"});
  table
      .output("spatial_error", y.spatial_error, "m",
              "estimated error of shape and displacements by the order of the strain polynomials; 0 for pade_euler")
      .nominal(1e-6)
      .depends({"strain", "T", "delta_guess", "gravity", "tip_force", "tip_moment"});
  table
      .output("evaluations", y.evaluations, "1",
              "evaluations of the residual since the start, by steps and equilibria; part of the state")
      .nominal(1e3);
  for (std::size_t k = 0; k < rod::kShapeStations; ++k)
    for (std::size_t c = 0; c < 3; ++c)
      table
          .output("shape.p[" + std::to_string(k + 1) + "," + std::to_string(c + 1) + "]", y.shape[k][c], "m",
                  std::string("centreline at evenly spaced points from the clamp, ") + kAxes[c])
          .nominal(0.01)
          .depends({"strain"});
}

/// Ports for models of the surroundings: forces along the body, velocities where they act, reaction of the clamp.
void add_ports(Table& table, const rod::Inputs& u, const rod::Outputs& y) {
  const std::vector<std::string> acting = {"strain",  "strain_rate", "T",          "delta_guess",
                                           "gravity", "tip_force",   "tip_moment", "shape.f"};
  for (std::size_t m = 0; m < rod::kShapeStations; ++m)
    for (std::size_t c = 0; c < 3; ++c)
      table
          .input(element("shape.f", m, c), u.load[m][c], "N/m",
                 std::string("force per length of the straight body at the points of shape.p, linear between, ") +
                     kAxes[c])
          .nominal(0.1);
  for (std::size_t m = 0; m < rod::kShapeStations; ++m)
    for (std::size_t c = 0; c < 3; ++c)
      table
          .output(element("shape.v", m, c), y.shape_v[m][c], "m/s",
                  std::string("velocity of the points of shape.p, ") + kAxes[c])
          .nominal(0.1)
          .depends({"strain", "strain_rate"});
  for (std::size_t c = 0; c < 3; ++c)
    table
        .output(fmu::indexed("base.force", c), y.base_force[c], "N",
                std::string("force of the clamp on the rod along ") + kAxes[c])
        .nominal(0.01)
        .on_demand()
        .depends(acting);
  for (std::size_t c = 0; c < 3; ++c)
    table
        .output(fmu::indexed("base.moment", c), y.base_moment[c], "N.m",
                std::string("moment of the clamp on the rod about ") + kAxes[c])
        .nominal(1e-4)
        .on_demand()
        .depends(acting);
}

/// Coefficients of the largest rod and their rates, in the order of Rod::to_states.
void add_states(Table& table, std::size_t segments, bool has_ports) {
  constexpr const char* kind[6] = {"curvature", "curvature", "twist", "shear", "shear", "stretch"};
  const auto name = [](const char* vector, std::size_t a, std::size_t c) {
    return std::string(vector) + "[" + std::to_string(a + 1) + "," + std::to_string(c + 1) + "]";
  };
  const auto description = [&](std::size_t a, std::size_t c) {
    return std::string(kind[c]) + ", " + kAxes[c % 3] + (c < 3 ? ", times the length" : "") +
           ": coefficient of the Legendre polynomial of degree " + std::to_string(a % (rod::kMaxOrder + 1)) +
           (segments > 1 ? " in segment " + std::to_string(a / (rod::kMaxOrder + 1) + 1) : "");
  };
  std::vector<std::string> acting = {"strain", "strain_rate", "T", "delta_guess", "gravity", "tip_force", "tip_moment"};
  if (has_ports) acting.push_back("shape.f");
  constexpr std::size_t terms = rod::kMaxOrder + 1;  // the first index goes on from segment to segment
  for (std::size_t a = 0; a < segments * terms; ++a)
    for (std::size_t c = 0; c < 6; ++c)
      table.state(name("strain", a, c), "1", "1/s", description(a, c))
          .nominal(0.1)
          .depends({name("strain_rate", a, c)});
  for (std::size_t a = 0; a < segments * terms; ++a)
    for (std::size_t c = 0; c < 6; ++c)
      table.state(name("strain_rate", a, c), "1/s", "1/s2", "rate of " + description(a, c)).depends(acting);
  table.state("dissipation", "J", "W", "energy dissipated by the damping since the start")
      .nominal(1e-4)
      .depends({"strain_rate"});
}

/// Parameters of material and TCA laws, which may change in a rod that moves: its strains keep their meaning. Not so
/// the geometry and what chooses the discretisation; nor parameters that set others, whose derivative is ambiguous.
constexpr const char* kRetuned[] = {
    "segment.E",
    "segment.nu",
    "segment.rho",
    "segment.shear_factor",
    "segment.retardation",
    "segment.stiffness",
    "segment.curvature",
    "tca.wire_diameter",
    "tca.coils",
    "tca.twists",
    "tca.E",
    "tca.rho_T",
    "tca.stiffness",
    "tca.stiffening",
    "tca.stroke",
    "tca.stroke_curvature",
    "tca.stop",
    "tca.stop_width",
    "tca.stop_stiffness",
    "tip_body.inertia",
    "tip_body.centre",
    "body.stiffness",
    "body.curvature",
};

void mark_retuned(std::vector<fmu::Variable>& rows) {
  for (fmu::Variable& row : rows) {
    if (row.causality != fmu::Causality::parameter) continue;
    const std::size_t bracket = row.name.find('[');
    const bool is_element = bracket != std::string::npos && row.also.empty();
    const bool is_listed = std::ranges::find(kRetuned, row.name.substr(0, bracket)) != std::end(kRetuned);
    if ((is_element && is_listed) || row.name == "T_0" || row.name == "tip_body.mass") row.retuned();
  }
}

}  // namespace

fmu::Identity fmu::identity() {
  return {.name = "rod", .description = "Dynamic Cosserat rod driven by twisted-and-coiled actuators"};
}

std::vector<fmu::Variable> fmu::variables(const fmu::Configuration& configuration) {
  const rod::Data defaults(configuration.tcas, configuration.segments, configuration.has_ports);
  const rod::Parameters& p = defaults.parameters;
  Table<rod::Data> table(defaults);
  add_parameters(table, p);
  add_inputs(table, defaults.inputs);
  add_outputs(table, defaults.outputs, p.tcas);
  if (configuration.has_ports) add_ports(table, defaults.inputs, defaults.outputs);
  add_states(table, p.segments, configuration.has_ports);
  std::vector<Variable> rows = std::move(table).rows();
  mark_retuned(rows);
  return rows;
}

std::unique_ptr<fmu::Model> fmu::make_model(const fmu::Configuration& configuration) {
  return std::make_unique<rod::RodModel>(configuration.tcas, configuration.segments, configuration.has_ports);
}
