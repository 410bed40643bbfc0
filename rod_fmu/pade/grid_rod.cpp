// Newton's method on the whole grid for one step of backward Euler (Eq. 24), and the steps built from it.
// Units while solving: length L, force EA = F, time h (node.hpp).
#include "pade/grid_rod.hpp"

#include <algorithm>
#include <cmath>

#include "integration/halving.hpp"

namespace rod {

using pade::TcaVector;
using pade::Vector3;
using pade::Vector6;

namespace {

constexpr int kMaxIterations = 25;
constexpr double kNewtonTolerance = 1e-11;  // of the last correction; the error behind it is its square
constexpr double kMaxCorrection = 1.0;      // about a radian, or a stretch of 100 %
constexpr double kSafeCorrection = 1e-6;    // applied without backtracking: rounding may hide that the residual falls
constexpr double kMinDamping = 1.0 / 64.0;
constexpr double kMinShare = 1e-3;  // of a jump in load

Vector3 three(const Vec3& a) { return {a.x, a.y, a.z}; }

}  // namespace

/// Equations of one step, in their own units.
struct GridRod::StepEquations {
  pade::ScaledSection section;
  Vector6 row_scale;              // of the balance of momentum
  Vector3 tip_moment, tip_force;  // in the frame of the tip before the step
  double length, force;           // units [m, N]
  bool inside;
  TcaVector delta_guess, reference_length;
  PerTca<double> T;
  TcaVector N_before;  // tensions and tip load of the step before, minus those of this step at its start
  Vector3 moment_before, force_before;
  double withheld;                // share of this jump that is not applied
  TcaVector delta_before, delta;  // delta is an unknown beside z
  TcaVector N, N_slope;
};

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
  const Vector3 J = three(section_.inertia);
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
    b.gravity = back * three(loads.gravity);
    b.stretch = state.stretch(k);
    for (int i = 0; i < tcas_; ++i) b.r[i] = r_[k][i] / L, b.r_slope[i] = r_slope_[k][i];
    scratch.z[k] = b.z;
    if (k + 1 == points_) {
      s.tip_moment = back * three(loads.tip_moment) / (F * L);
      s.tip_force = back * three(loads.tip_force) / F;
      s.moment_before = back * state.tip_load().head<3>() / (F * L) - s.tip_moment;
      s.force_before = back * state.tip_load().tail<3>() / F - s.tip_force;
    }
  }
  return s;
}

namespace {

struct Residual {
  double size = 0.0;  // sum of squares
  TcaVector closure;  // delta - (int eps' ds - L_i)
};

/// Evaluates all points at (z, s.delta) and writes their equations to the solver.
template <class StepEquations>
Residual assemble(StepEquations& s, const std::vector<TcaLaw>& laws, const std::vector<double>& weight,
                  const std::vector<pade::NodeVector>& z, GridScratch& scratch) {
  ++scratch.evaluations;
  const int n = static_cast<int>(z.size()), tcas = static_cast<int>(laws.size());
  const double spacing = 1.0 / (n - 1);
  for (int i = 0; i < tcas; ++i) {
    const Tension tension = laws[i].tension(s.inside ? s.length * s.delta[i] : s.delta_guess[i], s.T[i]);
    s.N[i] = tension.value / s.force + s.withheld * s.N_before[i];
    s.N_slope[i] = s.inside ? tension.per_delta * s.length / s.force : 0.0;
  }
  Residual residual;
  residual.closure = s.delta + s.reference_length;
  for (int k = 0; k < n; ++k) {
    pade::node_equations(s.section, scratch.before[k], z[k], s.N, scratch.node_equations[k]);
    residual.closure -= weight[k] / s.length * scratch.node_equations[k].stretch;
  }
  residual.size = residual.closure.squaredNorm();

  // Each write() adds six equations value = 0, with their derivatives in the unknowns of each point and in the
  // tensions.
  scratch.solver.clear();
  Vector6 value;
  Eigen::Matrix<double, 6, pade::kReach * pade::kFields> slope;
  pade::Matrix6xTca slope_N(6, tcas);
  const auto write = [&](int first, const Vector6& scale) {
    value.array() *= scale.array();
    residual.size += value.squaredNorm();
    for (int c = 0; c < 6; ++c) {
      pade::FrontalSolver::Equation& e = scratch.solver.add(first);
      for (int j = 0; j < pade::kReach * pade::kFields; ++j) e.a[j] = scale[c] * slope(c, j);
      e.b[0] = value[c];
      for (int i = 0; i < tcas; ++i) e.b[1 + i] = scale[c] * slope_N(c, i) * s.N_slope[i];
    }
  };
  const auto clear = [&] { value.setZero(), slope.setZero(), slope_N.setZero(); };
  const Vector6 one = Vector6::Ones();

  clear();  // the clamp does not move
  value = z[0].template tail<6>();
  slope.template block<6, 6>(0, 6).setIdentity();
  write(0, one);
  for (int k = 0; k < n; ++k) {
    const pade::DifferenceRow& row = scratch.rows[k];
    if (k + 1 < n) {
      clear();
      for (int j = 0; j < row.count; ++j) {
        const pade::NodeEquations& b = scratch.node_equations[row.first + j];
        const double a = spacing * row.slope[j];
        value += a * b.eta_slope - row.value[j] * z[row.first + j].template tail<6>();
        slope.template middleCols<pade::kFields>(j * pade::kFields) = a * b.eta_slope_z;
        slope.template middleCols<6>(j * pade::kFields + 6).diagonal().array() -= row.value[j];
      }
      write(row.first, one);
    }
    if (k > 0) {
      clear();
      for (int j = 0; j < row.count; ++j) {
        const pade::NodeEquations& b = scratch.node_equations[row.first + j];
        const double a = spacing * row.slope[j];
        value += a * b.W_slope - row.value[j] * b.W;
        slope.template middleCols<pade::kFields>(j * pade::kFields) = a * b.W_slope_z - row.value[j] * b.W_z;
        slope_N += a * b.W_slope_N - row.value[j] * b.W_N;
      }
      write(row.first, s.row_scale);
    }
  }
  clear();  // the tip carries its load
  const pade::NodeEquations& tip = scratch.node_equations[n - 1];
  const Vector3 w = z[n - 1].template segment<3>(6);
  const pade::BodyFrameVector moment = pade::in_body_frame(s.tip_moment + s.withheld * s.moment_before, w);
  const pade::BodyFrameVector force = pade::in_body_frame(s.tip_force + s.withheld * s.force_before, w);
  value << tip.W.head<3>() - moment.value, tip.W.tail<3>() - force.value;
  slope.template leftCols<pade::kFields>() = tip.W_z;
  slope.template block<3, 3>(0, 6) -= moment.slope;
  slope.template block<3, 3>(3, 6) -= force.slope;
  slope_N = tip.W_N;
  write(n - 1, s.row_scale);
  return residual;
}

/// Solves for the correction of delta after the grid is eliminated, by the Schur complement S d = rhs; the correction
/// of delta is -d.
template <class StepEquations>
TcaVector border(const StepEquations& s, const std::vector<double>& weight, const Residual& residual,
                 const GridScratch& scratch) {
  using TcaMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxTcas, kMaxTcas>;
  const int tcas = static_cast<int>(residual.closure.size());
  TcaMatrix S = TcaMatrix::Identity(tcas, tcas);
  TcaVector rhs = residual.closure;
  const int n = static_cast<int>(weight.size());
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < 6; ++j) {
      const TcaVector slope = weight[k] / s.length * scratch.node_equations[k].stretch_xi.row(j).transpose();
      rhs += slope * scratch.solver(k, j, 0);
      for (int i = 0; i < tcas; ++i) S.col(i) += slope * scratch.solver(k, j, 1 + i);
    }
  return S.partialPivLu().solve(rhs);
}

}  // namespace

/// From (scratch.z, s.delta) to the solution, with a share of the step's jump in load withheld.
bool GridRod::newton(StepEquations& s, double withheld, GridScratch& scratch) const {
  s.withheld = withheld;
  Residual residual = assemble(s, laws_, weight_, scratch.z, scratch);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    if (!std::isfinite(residual.size) || !scratch.solver.solve()) return false;
    const TcaVector d = border(s, weight_, residual, scratch);
    double correction = d.lpNorm<Eigen::Infinity>();
    for (int k = 0; k < points_; ++k)
      for (int j = 0; j < pade::kFields; ++j) {
        double& change = scratch.change[k][j];
        change = scratch.solver(k, j, 0);
        for (int i = 0; i < tcas_; ++i) change -= scratch.solver(k, j, 1 + i) * d[i];
        correction = std::max(correction, std::abs(change));
      }
    if (!std::isfinite(correction)) return false;

    const double size = residual.size, first = std::min(1.0, kMaxCorrection / correction);
    double applied = 0.0;
    for (double damping = first;; damping *= 0.5) {
      if (damping < kMinDamping * first) return false;
      for (int k = 0; k < points_; ++k) scratch.z[k] -= (damping - applied) * scratch.change[k];
      s.delta -= (damping - applied) * d;
      applied = damping;
      if (correction <= kNewtonTolerance) return true;
      residual = assemble(s, laws_, weight_, scratch.z, scratch);
      if (residual.size <= (1.0 - 1e-4 * damping) * size || correction <= kSafeCorrection) break;
    }
  }
  return false;
}

/// Applies the step's change of tensions and tip load in parts. A TCA that is heated suddenly, for example, compresses
/// a body that has not moved yet so much that the section loses its stiffness in shear and Newton's method diverges.
bool GridRod::newton_with_homotopy(StepEquations& s, GridScratch& scratch) const {
  TcaVector firm_delta = s.delta_before;
  for (int k = 0; k < points_; ++k) scratch.accepted[k] = scratch.before[k].z;
  double done = 0.0, share = 0.25;
  while (done < 1.0) {
    const double next = std::min(1.0, done + share);
    std::copy(scratch.accepted.begin(), scratch.accepted.end(), scratch.z.begin());
    s.delta = firm_delta;
    if (newton(s, 1.0 - next, scratch)) {
      std::copy(scratch.z.begin(), scratch.z.end(), scratch.accepted.begin());
      firm_delta = s.delta;
      done = next;
      share *= 2.0;
    } else {
      share *= 0.25;
      if (share < kMinShare) return false;
    }
  }
  return true;
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
  state.tip_load() << three(loads.tip_moment), three(loads.tip_force);
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
