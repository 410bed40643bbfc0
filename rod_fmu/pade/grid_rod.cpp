// A rod on a grid: its discretisation, steps, and equilibrium.
#include "pade/grid_rod.hpp"

#include <algorithm>
#include <cmath>

#include "integration/halving.hpp"
#include "pade/step_equations.hpp"
#include "pade/to_eigen.hpp"

namespace rod {

using pade::to_eigen;

GridRod::GridRod(const Parameters& p, const Section& section, int points)
    : points_(points),
      tcas_(static_cast<int>(p.tcas)),
      length_(p.length()),
      spacing_(p.length() / (points - 1)),
      section_(section),
      closure_(p.closure),
      weight_(points),
      r_(points),
      r_slope_(points) {
  for (std::size_t i = 0; i < p.tcas; ++i) laws_.emplace_back(p, i);
  const double EI = std::min(section.stiffness[0], section.stiffness[1]);
  period_ = length_ * length_ * std::sqrt(section.mass / EI);
  for (int k = 0; k + 1 < points; ++k) {
    const pade::IntervalRule part = pade::interval_rule(k, points);
    for (int j = 0; j < pade::kReach; ++j) weight_[part.first + j] += spacing_ * part.weight[j];
  }
  reference_length_.setZero(tcas_);
  const Vector6 reference = Eigen::Map<const Vector6>(section.reference.data());
  for (int k = 0; k < points; ++k)
    for (int i = 0; i < tcas_; ++i) {
      const Tca& tca = p.tca[i];
      const double angle = tca.azimuth + tca.helix * spacing_ * k;
      const double gradient = (tca.offset_end - tca.offset) / length_;
      const double distance = tca.offset + gradient * spacing_ * k;
      const Vector3 direction{std::cos(angle), std::sin(angle), 0.0};
      r_[k][i] = distance * direction;
      r_slope_[k][i] = tca.helix * distance * Vector3{-direction[1], direction[0], 0.0} + gradient * direction;
      const Vector3 kappa = reference.head<3>(), lambda = reference.tail<3>();
      reference_length_[i] += weight_[k] * (lambda + kappa.cross(r_[k][i]) + r_slope_[k][i]).norm();
    }
}

double GridRod::crossing_time() const {
  const double stiffest = *std::max_element(section_.stiffness.begin() + 3, section_.stiffness.end());
  return std::max(0.0, spacing_ * std::sqrt(section_.mass / stiffest) - section_.retardation);
}

GridScratch GridRod::scratch() const {
  GridScratch s;
  s.before.resize(points_);
  s.z.resize(points_);
  s.change.resize(points_);
  s.accepted.resize(points_);
  s.node_equations.resize(points_);
  s.solver.resize(points_, tcas_);
  s.backup.resize(GridState::size(points_, tcas_));
  for (int k = 0; k < points_; ++k) s.rows.push_back(pade::compact_row(k, points_));
  return s;
}

void GridRod::set_unloaded(const GridState& state) const {
  std::fill(state.memory().begin(), state.memory().end(), 0.0);
  for (int k = 0; k < points_; ++k) state.strain(k) = Eigen::Map<const Vector6>(section_.reference.data());
  fit_stretch(state);
  fit_pose(state);
}

void GridRod::fit_stretch(const GridState& state) const {
  for (int k = 0; k < points_; ++k) {
    const Vector3 kappa = state.strain(k).head<3>(), lambda = state.strain(k).tail<3>();
    for (int i = 0; i < tcas_; ++i) state.stretch(k)[i] = (lambda + kappa.cross(r_[k][i]) + r_slope_[k][i]).norm();
  }
}

void GridRod::fit_pose(const GridState& state) const {
  // g' = g xi^ from g(0) = I (Eq. 5): the Magnus expansion of order 4 for the rotation, then p' = R lambda. The
  // rotation vector of an interval is the integral of kappa plus spacing^2/12 kappa_k x kappa_{k+1}.
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  state.quaternion(0) << 1.0, 0.0, 0.0, 0.0;
  for (int k = 0; k + 1 < points_; ++k) {
    const pade::IntervalRule part = pade::interval_rule(k, points_);
    Vector3 rotation = spacing_ * spacing_ / 12.0 * state.strain(k).head<3>().cross(state.strain(k + 1).head<3>());
    for (int j = 0; j < pade::kReach; ++j)
      rotation += spacing_ * part.weight[j] * state.strain(part.first + j).head<3>();
    const double half = 0.5 * rotation.norm();
    const double sinc = half > 1e-4 ? std::sin(half) / half : 1.0 - half * half / 6.0;
    const Vector3 axis = 0.5 * sinc * rotation;
    turn = (turn * Eigen::Quaterniond(std::cos(half), axis[0], axis[1], axis[2])).normalized();
    state.quaternion(k + 1) << turn.w(), turn.x(), turn.y(), turn.z();
  }
  const auto tangent = [&state](int k) -> Vector3 {
    const auto q = state.quaternion(k);
    return Eigen::Quaterniond(q[0], q[1], q[2], q[3]) * state.strain(k).tail<3>();
  };
  state.position(0).setZero();
  for (int k = 0; k + 1 < points_; ++k) {
    const pade::IntervalRule part = pade::interval_rule(k, points_);
    Vector3 p = state.position(k);
    for (int j = 0; j < pade::kReach; ++j) p += spacing_ * part.weight[j] * tangent(part.first + j);
    state.position(k + 1) = p;
  }
}

TcaVector GridRod::displacements(const ConstGridState& state) const {
  TcaVector delta = -reference_length_;
  for (int k = 0; k < points_; ++k) delta += weight_[k] * state.stretch(k);
  return delta;
}

GridRod::StepEquations GridRod::step_equations(const Loads& loads, double h, const GridState& state,
                                               GridScratch& scratch) const {
  const double L = length_, F = section_.stiffness[5];
  StepEquations s;
  for (TcaVector* each : {&s.delta_guess, &s.N_before, &s.N, &s.N_slope}) each->setZero(tcas_);
  s.length = L;
  s.force = F;
  s.inside = closure_ == Closure::inside;
  s.T = loads.T;
  const Vector3 J = to_eigen(section_.inertia);
  for (int c = 0; c < 6; ++c) {
    const double unit = c < 3 ? 1.0 / L : 1.0;
    s.section.stiffness[c] = section_.stiffness[c] / F * unit * unit;
    s.section.damping[c] = section_.retardation / h * s.section.stiffness[c];
    s.section.inertia[c] = (c < 3 ? J[c] : section_.mass * L * L) / (F * h * h);
    s.section.reference[c] = section_.reference[c] / unit;
    s.row_scale[c] = 1.0 / (s.section.stiffness[c] + s.section.damping[c] + s.section.inertia[c] / (points_ - 1));
  }
  s.section.mass = section_.mass * L / F;
  for (int i = 0; i < tcas_; ++i) s.delta_guess[i] = loads.delta_guess[i];
  s.reference_length = reference_length_ / L;
  s.delta = s.delta_before = displacements(state) / L;
  for (int i = 0; i < tcas_; ++i) {
    const double immediate = laws_[i].tension(s.inside ? L * s.delta[i] : s.delta_guess[i], s.T[i]).value;
    s.N_before[i] = (state.tension()[i] - immediate) / F;
  }

  for (int k = 0; k < points_; ++k) {
    const auto q = state.quaternion(k);
    const Eigen::Quaterniond back = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).conjugate();
    pade::PreviousNode& b = scratch.before[k];
    b.z << L * state.strain(k).head<3>(), state.strain(k).tail<3>(), h * state.velocity(k).head<3>(),
        h / L * state.velocity(k).tail<3>();
    b.gravity = back * to_eigen(loads.gravity);
    b.stretch = state.stretch(k);
    for (int i = 0; i < tcas_; ++i) b.r[i] = r_[k][i] / L, b.r_slope[i] = r_slope_[k][i];
    scratch.z[k] = b.z;
    if (k + 1 == points_) {
      s.tip_moment = back * to_eigen(loads.tip_moment) / (F * L);
      s.tip_force = back * to_eigen(loads.tip_force) / F;
      s.moment_before = back * state.tip_load().head<3>() / (F * L) - s.tip_moment;
      s.force_before = back * state.tip_load().tail<3>() / F - s.tip_force;
    }
  }
  return s;
}

bool GridRod::one_step(const Loads& loads, double h, const GridState& state, GridScratch& scratch) const {
  StepEquations s = step_equations(loads, h, state, scratch);
  if (!newton(s, 0.0, scratch) && !newton_with_homotopy(s, scratch)) return false;
  accept(s, loads, h, state, scratch);
  return true;
}

void GridRod::accept(const StepEquations& s, const Loads& loads, double h, const GridState& state,
                     GridScratch& scratch) const {
  const TcaVector delta = displacements(state);
  double heat = 0.0;
  for (int k = 0; k < points_; ++k) {
    pade::node_equations(s.section, scratch.before[k], scratch.z[k], s.N, scratch.node_equations[k]);
    const pade::NodeVector& z = scratch.z[k];
    const Vector6 change = z.head<6>() - scratch.before[k].z.head<6>();
    heat += weight_[k] * s.force * change.dot(s.section.damping.cwiseProduct(change));
    state.strain(k) << z.head<3>() / length_, z.segment<3>(3);
    state.velocity(k) << z.segment<3>(6) / h, length_ / h * z.tail<3>();
    state.stretch(k) = scratch.node_equations[k].stretch;
  }
  state.dissipated() += heat;
  state.tension() = s.force * s.N;
  state.tip_load() << to_eigen(loads.tip_moment), to_eigen(loads.tip_force);
  state.delta_rate() = (displacements(state) - delta) / h;
  fit_pose(state);
}

StepOutcome GridRod::step(const Inputs& u, double h, const GridState& state, GridScratch& scratch) const {
  return advance_halving(
      h, [&](double from, double length) { return one_step(loads_at(u, from + length), length, state, scratch); });
}

core::Status GridRod::solve_equilibrium(const Loads& loads, const GridState& state, GridScratch& scratch) const {
  // Dynamic relaxation: steps that grow without bound. Inertia regularises the first; the last are Newton steps of
  // statics. Velocity and history are dropped on the way.
  std::copy(state.memory().begin(), state.memory().end(), scratch.backup.begin());
  const double dissipated = state.dissipated();
  for (double h = 0.01 * period_; h < 1e12 * period_; h *= 10.0) {
    if (!one_step(loads, h, state, scratch)) {
      std::copy(scratch.backup.begin(), scratch.backup.end(), state.memory().begin());
      return core::Status::discard("no equilibrium found (dynamic relaxation failed)",
                                   "reduce the loads, or their change in one step");
    }
    for (int k = 0; k < points_; ++k) state.velocity(k).setZero();
    fit_stretch(state);
  }
  state.delta_rate().setZero();
  state.dissipated() = dissipated;
  return {};
}

}  // namespace rod
