// Inputs and outputs, and the ports for models of the surroundings.
#include <string>
#include <vector>

#include "fmu/rows.hpp"

namespace rod {

void add_inputs(Table& table, const Inputs& u) {
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

void add_outputs(Table& table, const Outputs& y, std::size_t tcas) {
  for (std::size_t i = 0; i < tcas; ++i)
    table.output(fmu::indexed("delta", i), y.delta[i], y.delta_rate[i], "m", "displacement of the TCA")
        .nominal(1e-3)
        .depends({"strain"})
        .on_demand(part::tcas);
  for (std::size_t i = 0; i < tcas; ++i)
    table.output(fmu::indexed("N", i), y.N[i], "N", "tension of the TCA")
        .nominal(0.1)
        .depends({fmu::indexed("T", i), fmu::indexed("delta_guess", i), "strain"})
        .on_demand(part::tcas);
  for (std::size_t c = 0; c < 3; ++c)
    table.output(fmu::indexed("tip.p", c), y.tip_p[c], "m", std::string("tip position, ") + kAxes[c])
        .nominal(0.01)
        .depends({"strain"})
        .on_demand(part::tip_position);
  constexpr const char* angle[3] = {"alpha", "beta", "gamma"};
  for (std::size_t c = 0; c < 3; ++c)
    table
        .output(fmu::indexed("tip.euler", c), y.tip_euler[c], "rad",
                std::string(angle[c]) + " of the tip's rotation Rx(alpha) Ry(beta) Rz(gamma)")
        .depends({"strain"})
        .on_demand(part::tip_orientation);
  for (std::size_t c = 0; c < 4; ++c)
    table.output(fmu::indexed("tip.quaternion", c), y.tip_quaternion[c], "1", "tip orientation, scalar part first")
        .depends({"strain"})
        .on_demand(part::tip_orientation);
  for (std::size_t c = 0; c < 3; ++c)
    table.output(fmu::indexed("tip.v", c), y.tip_v[c], "m/s", std::string("tip velocity, ") + kAxes[c])
        .nominal(0.1)
        .depends({"strain", "strain_rate"})
        .on_demand(part::tip_velocity);
  table.output("energy.elastic", y.energy_elastic, "J", "strain energy of the body")
      .nominal(1e-4)
      .depends({"strain"})
      .on_demand(part::energy);
  table
      .output("energy.tca", y.energy_tca, "J",
              "energy of the TCAs, the potential of N in delta; in delta_guess when closure = exchanged")
      .nominal(1e-4)
      .depends({"T", "delta_guess", "strain"})
      .on_demand(part::energy);
  table.output("energy.kinetic", y.energy_kinetic, "J", "kinetic energy")
      .nominal(1e-4)
      .depends({"strain", "strain_rate"})
      .on_demand(part::energy);
  table.output("energy.gravity", y.energy_gravity, "J", "gravitational potential, 0 for all mass at the clamp")
      .nominal(1e-4)
      .depends({"gravity", "strain"})
      .on_demand(part::energy);
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
  for (std::size_t k = 0; k < kShapeStations; ++k)
    for (std::size_t c = 0; c < 3; ++c)
      table
          .output("shape.p[" + std::to_string(k + 1) + "," + std::to_string(c + 1) + "]", y.shape[k][c], "m",
                  std::string("centreline at evenly spaced points from the clamp, ") + kAxes[c])
          .nominal(0.01)
          .depends({"strain"})
          .on_demand(part::shape);
}

void add_creep(Table& table, const Outputs& y, std::size_t tcas) {
  for (std::size_t i = 0; i < tcas; ++i)
    table.output(fmu::indexed("creep", i), y.creep[i], "m", "creep of the TCA since the start")
        .nominal(1e-3)
        .on_demand(part::tcas);
}

void add_ports(Table& table, const Inputs& u, const Outputs& y) {
  const std::vector<std::string> acting = {"strain",  "strain_rate", "T",          "delta_guess",
                                           "gravity", "tip_force",   "tip_moment", "shape.f"};
  for (std::size_t m = 0; m < kShapeStations; ++m)
    for (std::size_t c = 0; c < 3; ++c)
      table
          .input(element("shape.f", m, c), u.load[m][c], "N/m",
                 std::string("force per length of the straight body at the points of shape.p, linear between, ") +
                     kAxes[c])
          .nominal(0.1);
  for (std::size_t m = 0; m < kShapeStations; ++m)
    for (std::size_t c = 0; c < 3; ++c)
      table
          .output(element("shape.v", m, c), y.shape_v[m][c], "m/s",
                  std::string("velocity of the points of shape.p, ") + kAxes[c])
          .nominal(0.1)
          .depends({"strain", "strain_rate"})
          .on_demand(part::shape);
  for (std::size_t c = 0; c < 3; ++c)
    table
        .output(fmu::indexed("base.force", c), y.base_force[c], "N",
                std::string("force of the clamp on the rod along ") + kAxes[c])
        .nominal(0.01)
        .on_demand(part::clamp)
        .depends(acting);
  for (std::size_t c = 0; c < 3; ++c)
    table
        .output(fmu::indexed("base.moment", c), y.base_moment[c], "N.m",
                std::string("moment of the clamp on the rod about ") + kAxes[c])
        .nominal(1e-4)
        .on_demand(part::clamp)
        .depends(acting);
}

}  // namespace rod
