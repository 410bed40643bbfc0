// Newton's method on the whole grid for one step of backward Euler (Eq. 24), and the homotopy of loads behind it.
#include <algorithm>
#include <cmath>

#include "pade/step_equations.hpp"

namespace rod {

namespace {

constexpr int kMaxIterations = 25;
constexpr double kNewtonTolerance = 1e-11;  // of the last correction; the error behind it is its square
constexpr double kMaxCorrection = 1.0;      // about a radian, or a stretch of 100 %
constexpr double kSafeCorrection = 1e-6;    // applied without backtracking: rounding may hide that the residual falls
constexpr double kMinDamping = 1.0 / 64.0;
constexpr double kMinShare = 1e-3;  // of a jump in load

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

}  // namespace rod
