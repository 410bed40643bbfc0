// Parameters in their order, and which of them may be tuned.
#include <algorithm>
#include <iterator>

#include "fmu/shared_rows.hpp"

namespace rod {

void add_parameters(Table& table, const Parameters& p, bool has_creep) {
  SharedRows shared(table, p);
  add_body(table, shared, p);
  add_tcas(table, shared, p, has_creep);
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
                  within(0, kMaxOrder));
  table.parameter("grid_points", p.grid_points, "", "grid points along the rod, used when method = pade_euler")
      .range(kMinGridPoints, kMaxGridPoints);
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

namespace {

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
    "tca.creep_compliance",
    "tca.creep_time",
    "tca.creep_activation",
    "tca.stop_width",
    "tca.stop_stiffness",
    "tip_body.inertia",
    "tip_body.centre",
    "body.stiffness",
    "body.curvature",
};

}  // namespace

void mark_retuned(std::vector<fmu::Variable>& rows) {
  for (fmu::Variable& row : rows) {
    if (row.causality != fmu::Causality::parameter) continue;
    const std::size_t bracket = row.name.find('[');
    const bool is_element = bracket != std::string::npos && row.also.empty();
    const bool is_listed = std::ranges::find(kRetuned, row.name.substr(0, bracket)) != std::end(kRetuned);
    if ((is_element && is_listed) || row.name == "T_0" || row.name == "tip_body.mass") row.retuned();
  }
}

}  // namespace rod
