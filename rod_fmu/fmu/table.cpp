// The variable table of rod.fmu: one row per variable.
#include "model/table.hpp"

#include <algorithm>
#include <iterator>
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

void add_parameters(fmu::Table<rod::Data>& table, const rod::Parameters& p) {
  table.parameter("body.radius", p.body_radius, "m", "radius of the body").range(kTiny, 1e3).nominal(5e-3);
  table.parameter("body.length", p.body_length, "m", "length of the body").range(kTiny, 1e3).nominal(0.04);
  table.parameter("body.E", p.body_E, "Pa", "Young's modulus of the body").range(kTiny, kHuge).nominal(4e4);
  table.parameter("body.nu", p.body_nu, "1", "Poisson's ratio of the body").range(-0.999, 0.5);
  table.parameter("body.rho", p.body_rho, "kg/m3", "density of the body").range(kTiny, 1e9).nominal(1e3);
  table.parameter("body.shear_factor", p.body_shear_factor, "1", "shear correction factor").range(kTiny, 1e6);
  table
      .parameter("body.retardation", p.body_retardation, "s",
                 "Kelvin-Voigt retardation time: damping over stiffness of the body; 0: undamped")
      .range(0, 1e6)
      .nominal(5e-3);
  table
      .parameter("body.profile", p.body_profile, "",
                 "stiffness of the section: round, of a solid cylinder; given, by body.stiffness")
      .choices({"round", "given"});
  for (std::size_t c = 0; c < 6; ++c)
    table
        .parameter(fmu::indexed("body.stiffness", c), p.body_stiffness[c], c < 3 ? "N.m2" : "N",
                   std::string("stiffness of the section in ") + stiffness_kind(c) + kAxes[c % 3] +
                       ", used when body.profile = given")
        .range(kTiny, kHuge);
  for (std::size_t c = 0; c < 3; ++c)
    table
        .parameter(fmu::indexed("body.curvature", c), p.body_curvature[c], "1/m",
                   std::string("curvature of the unloaded body about ") + kAxes[c])
        .range(-1e6, 1e6)
        .nominal(10);
  table.parameter("tca.offset", p.tca_offset, "m", "distance of the TCAs from the centreline")
      .range(0, 1e3)
      .nominal(2.5e-3);
  for (std::size_t i = 0; i < rod::kTcas; ++i)
    table.parameter(fmu::indexed("tca.azimuth", i), p.tca_azimuth[i], "rad", "azimuth of the TCA at the clamp")
        .range(-100 * kFullTurn, 100 * kFullTurn);
  for (std::size_t i = 0; i < rod::kTcas; ++i)
    table
        .parameter(fmu::indexed("tca.helix", i), p.tca_helix[i], "rad/m",
                   "rotation of the TCA's azimuth per length of the rod")
        .range(-1e5, 1e5)
        .nominal(100);
  table
      .parameter("tca.law", p.tca_law, "",
                 "TCA law: wire, from data of the wire (Eq. 4); measured, from tca.stiffness and tca.stroke")
      .choices({"wire", "measured"});
  table
      .parameter("tca.pitch", p.tca_pitch, "",
                 "pitch angle of the coils: frozen, at its reference value; current, following delta")
      .choices({"frozen", "current"});
  table.parameter("tca.wire_length", p.tca_wire_length, "m", "length of the coiled wire")
      .range(kTiny, 1e3)
      .nominal(0.1);
  table.parameter("tca.wire_diameter", p.tca_wire_diameter, "m", "diameter of the wire")
      .range(kTiny, 1e3)
      .nominal(1e-3);
  table.parameter("tca.coils", p.tca_coils, "1", "number of coils").range(kTiny, 1e9).nominal(10);
  table.parameter("tca.twists", p.tca_twists, "1", "number of inserted twists").range(0, 1e9).nominal(100);
  table.parameter("tca.E", p.tca_E, "Pa", "Young's modulus of the wire").range(kTiny, kHuge).nominal(1e9);
  table.parameter("tca.rho_T", p.tca_rho_T, "1/K", "thermal expansion of the wire's diameter")
      .range(-1, 1)
      .nominal(1e-3);
  table.parameter("tca.chirality", p.tca_chirality, "", "+1: extends when heated, -1: contracts").range(-1, 1);
  table.parameter("tca.stiffness", p.tca_stiffness, "N/m", "stiffness of a TCA, used when tca.law = measured")
      .range(0, kHuge)
      .nominal(10);
  table.parameter("tca.stroke", p.tca_stroke, "m/K", "free stroke per kelvin, used when tca.law = measured")
      .range(-1, 1)
      .nominal(1e-4);
  table.parameter("T_0", p.T_0, "K", "temperature of zero free stroke").range(1, 1e5).nominal(300);
  table
      .parameter("closure", p.closure, "",
                 "displacements that the TCA forces follow: inside, those of the rod (Eq. 17); exchanged, delta_guess")
      .choices({"inside", "exchanged"});
  table.parameter("strains", p.strains, "", "strains of the rod; each choice contains those before it")
      .choices({"bending", "extensible", "kirchhoff", "cosserat"});
  table.parameter("planar", p.planar, "",
                  "true: motion in one plane through the axis; forces across it are left out, see out_of_plane");
  table.parameter("plane", p.plane, "rad", "azimuth of the plane of motion from the x axis, used when planar = true")
      .range(-100 * kFullTurn, 100 * kFullTurn);
  table.parameter("order", p.order, "", "degree of the strain polynomials").range(0, rod::kMaxOrder);
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
}

void add_inputs(fmu::Table<rod::Data>& table, const rod::Inputs& u) {
  for (std::size_t i = 0; i < rod::kTcas; ++i)
    table.input(fmu::indexed("T", i), u.T[i], "K", "mean temperature of the TCA").range(0, 1e5).nominal(300);
  for (std::size_t i = 0; i < rod::kTcas; ++i)
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

void add_outputs(fmu::Table<rod::Data>& table, const rod::Outputs& y) {
  for (std::size_t i = 0; i < rod::kTcas; ++i)
    table.output(fmu::indexed("delta", i), y.delta[i], y.delta_rate[i], "m", "displacement of the TCA")
        .nominal(1e-3)
        .depends({"strain"});
  for (std::size_t i = 0; i < rod::kTcas; ++i)
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

/// Coefficients of the largest rod and their rates, in the order of Rod::to_states.
void add_states(fmu::Table<rod::Data>& table) {
  constexpr const char* kind[6] = {"curvature", "curvature", "twist", "shear", "shear", "stretch"};
  const auto name = [](const char* vector, std::size_t a, std::size_t c) {
    return std::string(vector) + "[" + std::to_string(a + 1) + "," + std::to_string(c + 1) + "]";
  };
  const auto description = [&](std::size_t a, std::size_t c) {
    return std::string(kind[c]) + ", " + kAxes[c % 3] + (c < 3 ? ", times the length" : "") +
           ": coefficient of the Legendre polynomial of degree " + std::to_string(a);
  };
  for (std::size_t a = 0; a <= rod::kMaxOrder; ++a)
    for (std::size_t c = 0; c < 6; ++c)
      table.state(name("strain", a, c), "1", "1/s", description(a, c))
          .nominal(0.1)
          .depends({name("strain_rate", a, c)});
  for (std::size_t a = 0; a <= rod::kMaxOrder; ++a)
    for (std::size_t c = 0; c < 6; ++c)
      table.state(name("strain_rate", a, c), "1/s", "1/s2", "rate of " + description(a, c))
          .depends({"strain", "strain_rate", "T", "delta_guess", "gravity", "tip_force", "tip_moment"});
  table.state("dissipation", "J", "W", "energy dissipated by the damping since the start")
      .nominal(1e-4)
      .depends({"strain_rate"});
}

/// Parameters of material and TCA laws, which may change in a rod that moves: its strains keep their meaning. Not so
/// the geometry and what chooses the discretisation.
constexpr const char* kRetuned[] = {
    "body.E",         "body.nu",        "body.rho",          "body.shear_factor", "body.retardation",
    "body.stiffness", "body.curvature", "tca.wire_diameter", "tca.coils",         "tca.twists",
    "tca.E",          "tca.rho_T",      "tca.stiffness",     "tca.stroke",        "T_0",
};

void mark_retuned(std::vector<fmu::Variable>& rows) {
  for (fmu::Variable& row : rows) {
    const std::string vector = row.name.substr(0, row.name.find('['));
    if (row.causality == fmu::Causality::parameter && std::ranges::find(kRetuned, vector) != std::end(kRetuned))
      row.retuned();
  }
}

}  // namespace

fmu::Identity fmu::identity() {
  return {.name = "rod", .description = "Dynamic Cosserat rod driven by twisted-and-coiled actuators"};
}

std::vector<fmu::Variable> fmu::variables(const fmu::Configuration&) {
  const rod::Data defaults;
  Table<rod::Data> table(defaults);
  add_parameters(table, defaults.parameters);
  add_inputs(table, defaults.inputs);
  add_outputs(table, defaults.outputs);
  add_states(table);
  std::vector<Variable> rows = std::move(table).rows();
  mark_retuned(rows);
  return rows;
}

std::unique_ptr<fmu::Model> fmu::make_model(const fmu::Configuration&) { return std::make_unique<rod::RodModel>(); }
