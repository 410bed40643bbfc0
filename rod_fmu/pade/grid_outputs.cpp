// Outputs of a rod on grid points: pose, shape, displacements (Eq. 17), tensions (Eq. 4) and energies.
#include <algorithm>
#include <cmath>

#include "mechanics/rotations.hpp"
#include "pade/grid_rod.hpp"
#include "pade/to_eigen.hpp"

namespace rod {

using pade::to_eigen;
using pade::Vector3;
using pade::Vector6;

namespace {

Triple triple(const Vector3& a) { return {a[0], a[1], a[2]}; }

Eigen::Quaterniond orientation(const ConstGridState& state, int k) {
  const auto q = state.quaternion(k);
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
}

/// Position at s = at * spacing: the cubic with the positions and tangents of both neighbours, of 4th order.
Vector3 between(const ConstGridState& state, double at, double spacing) {
  const int k = std::min(static_cast<int>(at), state.points() - 2);
  const double x = at - k;
  const Vector3 m0 = spacing * (orientation(state, k) * state.strain(k).tail<3>());
  const Vector3 m1 = spacing * (orientation(state, k + 1) * state.strain(k + 1).tail<3>());
  return (1.0 + 2.0 * x) * (1.0 - x) * (1.0 - x) * state.position(k) + x * (1.0 - x) * (1.0 - x) * m0 +
         x * x * (3.0 - 2.0 * x) * state.position(k + 1) - x * x * (1.0 - x) * m1;
}

}  // namespace

void GridRod::outputs(const Loads& loads, const ConstGridState& state, Outputs& y, unsigned parts) const {
  if (parts & part::shape)
    for (std::size_t m = 0; m < kShapeStations; ++m)
      y.shape[m] = triple(between(state, static_cast<double>(m) * (points_ - 1) / (kShapeStations - 1), spacing_));
  const int tip = points_ - 1;
  const Eigen::Quaterniond turn = orientation(state, tip);
  y.tip_p = triple(state.position(tip));
  y.tip_quaternion = {turn.w(), turn.x(), turn.y(), turn.z()};
  if (parts & part::tip_orientation) y.tip_euler = euler_angles(rotation(turn.w(), turn.x(), turn.y(), turn.z()));
  y.tip_v = triple(turn * state.velocity(tip).tail<3>());
  y.energy_dissipated = state.dissipated();
  y.out_of_plane = 0.0;   // this rod is spatial
  y.spatial_error = 0.0;  // and has no polynomials; its grid's error shows in runs with more grid points
  if (parts & part::energy) body_energies(loads, state, y);
  if (!(parts & (part::energy | part::tcas))) return;
  y.creep = {};  // its TCAs do not creep
  double energy = 0.0;
  const pade::TcaVector delta = displacements(state);
  for (int i = 0; i < tcas_; ++i) {
    const double acting = closure_ == Closure::inside ? delta[i] : loads.delta_guess[i];
    y.delta[i] = delta[i];
    y.delta_rate[i] = state.delta_rate()[i];
    y.N[i] = laws_[i].tension(acting, loads.T[i]).value;
    if (parts & part::energy) energy += laws_[i].energy(acting, loads.T[i]);
  }
  if (parts & part::energy) y.energy_tca = energy;
}

void GridRod::body_energies(const Loads& loads, const ConstGridState& state, Outputs& y) const {
  const Vector6 stiffness = Eigen::Map<const Vector6>(section_.stiffness.data());
  const Vector6 reference = Eigen::Map<const Vector6>(section_.reference.data());
  Vector6 inertia;
  inertia << to_eigen(section_.inertia), Vector3::Constant(section_.mass);
  y.energy_elastic = y.energy_kinetic = y.energy_gravity = 0.0;
  for (int k = 0; k < points_; ++k) {
    const Vector6 strain = state.strain(k) - reference;
    const Vector6 velocity = state.velocity(k);
    y.energy_elastic += 0.5 * weight_[k] * strain.dot(stiffness.cwiseProduct(strain));
    y.energy_kinetic += 0.5 * weight_[k] * velocity.dot(inertia.cwiseProduct(velocity));
    y.energy_gravity -= section_.mass * weight_[k] * to_eigen(loads.gravity).dot(state.position(k));
  }
}

void GridRod::clamp_reaction(const Loads& loads, const ConstGridState& state, Outputs& y) const {
  const Vector6 stiffness = Eigen::Map<const Vector6>(section_.stiffness.data());
  const Vector6 reference = Eigen::Map<const Vector6>(section_.reference.data());
  Vector6 wrench = stiffness.cwiseProduct(state.strain(0) - reference);
  const pade::TcaVector delta = displacements(state);
  const Vector3 kappa = state.strain(0).head<3>(), lambda = state.strain(0).tail<3>();
  for (int i = 0; i < tcas_; ++i) {
    const double acting = closure_ == Closure::inside ? delta[i] : loads.delta_guess[i];
    const double N = laws_[i].tension(acting, loads.T[i]).value;
    const Vector3 u = lambda + kappa.cross(r_[0][i]) + r_slope_[0][i];
    wrench.head<3>() += N * r_[0][i].cross(u.normalized());
    wrench.tail<3>() += N * u.normalized();
  }
  y.base_moment = triple(-wrench.head<3>());
  y.base_force = triple(-wrench.tail<3>());
}

}  // namespace rod
