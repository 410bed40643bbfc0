// Cholesky test and overdamped motion; see the header.
#include "integration/stability.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace rod {

namespace {

constexpr double kMaxChange = 0.3;    // of a strain coefficient in one step [1], so that the motion is followed closely
constexpr int kMaxSteps = 1000;       // of the overdamped motion; a fall through a few radians takes 20 to 60
constexpr int kMaxMomentSteps = 150;  // the same under a dead moment, where the motion may never come to rest
constexpr double kNeutral = 1e-6;     // eigenvalues above minus this, over the stiffness, are neutral: a buckled round
                                      // rod, for example, turns about its axis at no cost
constexpr int kMaxTrials = 60;        // of one step with increasing damping
constexpr double kNewtonDamping = 1e-4;  // relative to the body's stiffness: below, steps are Newton steps
constexpr int kBisections = 20;          // of the time of departure: to 1e-6 of it
constexpr double kAtRest = 1e-8;         // largest residual of an equilibrium, over the stiffness [1]
constexpr double kDeparture = 1e-3;      // of the strains when the motion leaves an unstable equilibrium [1]
constexpr double kSmallShare = 1e-9;  // of a residual along growing modes [1]: below, the motion is taken for symmetric
constexpr int kMaxDepartures = 8;     // a rod passes few unstable equilibria on its way
constexpr double kNoLoad = 1e-12;     // residual over stiffness along growing modes [1] that is rounding: no load
                                      // chooses a direction
constexpr double kMarginPerDistance = 100.0;  // change of the tangent, over the stiffness, per change of a strain [1]
constexpr double kMaxMargin = 0.3;            // over the stiffness [1]: beyond, the tangent is taken anew

}  // namespace

bool has_moment(const Loads& loads) {
  return loads.tip_moment.x != 0.0 || loads.tip_moment.y != 0.0 || loads.tip_moment.z != 0.0;
}

/// Decides most cases by the tangent that Newton's method has left: that differs from the tangent at the solution by
/// less than the margin, and tensions that follow the displacements only add stiffness.
bool Stability::is_clearly_stable(const Rod& rod, const Loads& loads, const Newton& newton) {
  const double margin = std::max(kMarginPerDistance * newton.tangent_distance(), kNeutral);
  if (margin > kMaxMargin || !rod.has_stiff_tcas(newton.work, loads)) return false;
  cholesky_ = newton.symmetric_tangent();
  return cholesky_.factor(-margin, rod.stiffness().data());
}

bool Stability::is_stable(const Rod& rod, const Vector& q, const Loads& loads, const Newton& newton) {
  if (is_clearly_stable(rod, loads, newton)) return true;
  rod.static_residual(q.data(), loads, work_, r_);
  rod.tangent(work_, {.q = 1.0}, K_);
  rod.add_tca_stiffness(work_, loads, K_);
  if (factor(rod, K_, 0.0) || factor(rod, K_, kNeutral)) return true;
  if (!has_moment(loads)) return false;
  const Vector zero = Vector::Zero(rod.unknowns());
  Matrix M;
  rod.residual(q.data(), zero.data(), zero.data(), loads, work_, r_);
  rod.tangent(work_, {.a = 1.0}, M);
  const Eigen::MatrixXd pencil = Eigen::PartialPivLU<Eigen::MatrixXd>(M).solve(Eigen::MatrixXd(K_));
  return pencil.allFinite() && Eigen::EigenSolver<Eigen::MatrixXd>(pencil, false).eigenvalues().real().minCoeff() > 0.0;
}

bool Stability::factor(const Rod& rod, const Matrix& K, double damping) {
  cholesky_.assign(K.data(), static_cast<int>(K.rows()));
  return cholesky_.factor(damping, rod.stiffness().data());
}

Stability::Departure Stability::departure(const Rod& rod, Leave leave, Vector& change) const {
  const Eigen::VectorXd scale = rod.stiffness().array().sqrt().inverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * (0.5 * (K_ + K_.transpose())) * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(scaled);
  const Eigen::Index growing = (modes.eigenvalues().array() < -kNeutral).count();
  if (growing == 0) return Departure::none;
  const auto directions = modes.eigenvectors().leftCols(growing);
  const Eigen::VectorXd force = scale.cwiseProduct(-r_), along = directions.transpose() * force;
  const bool at_rest = (r_.array() / rod.stiffness().array()).abs().maxCoeff() <= kAtRest;
  if (!at_rest && (leave == Leave::at_rest || along.norm() > kSmallShare * force.norm())) return Departure::none;
  const auto to_strains = [&](const Eigen::VectorXd& amplitudes) {
    change = scale.cwiseProduct(directions * amplitudes);
    return change.lpNorm<Eigen::Infinity>();
  };
  if (to_strains(along) <= kNoLoad) {
    change = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(0.5 * (K_ + K_.transpose())).eigenvectors().col(0);
    change *= kDeparture / change.lpNorm<Eigen::Infinity>();
    return Departure::ambiguous;
  }
  // The linear motion of each mode, until the largest strain is as large as asked.
  const Eigen::ArrayXd rate = -modes.eigenvalues().head(growing).array();
  const auto moved = [&](double time) {
    return to_strains(along.array() * (rate * time).unaryExpr([](double x) { return std::expm1(x); }) / rate);
  };
  double shortest = 0.0, longest = 1.0 / rate.maxCoeff();
  while (moved(longest) < kDeparture) shortest = longest, longest *= 2.0;
  for (int k = 0; k < kBisections; ++k) {
    const double time = 0.5 * (shortest + longest);
    (moved(time) < kDeparture ? shortest : longest) = time;
  }
  moved(shortest);
  return Departure::chosen;
}

core::Status Stability::descend(const Rod& rod, const Loads& loads, double tolerance, Vector& q) {
  const Vector start = q;
  if (fall(rod, loads, tolerance, Leave::at_rest, q).is_ok()) return {};
  q = start;
  doubt_ = Doubt::none;
  return fall(rod, loads, tolerance, Leave::at_once, q);
}

core::Status Stability::fall(const Rod& rod, const Loads& loads, double tolerance, Leave leave, Vector& q) {
  int departures = 0;
  double damping = 1.0;
  rod.static_residual(q.data(), loads, work_, r_);
  const int max_steps = has_moment(loads) ? kMaxMomentSteps : kMaxSteps;
  for (int step = 0; step < max_steps; ++step) {
    rod.tangent(work_, {.q = 1.0}, K_);
    const bool stable = factor(rod, K_, kNeutral);
    if (!stable && departures < kMaxDepartures) {
      const Departure start = departure(rod, leave, change_);
      if (start == Departure::ambiguous) doubt_ = Doubt::ambiguous;
      if (start != Departure::none) {
        ++departures;
        q += change_;
        damping = 1.0;
        rod.static_residual(q.data(), loads, work_, r_);
        continue;
      }
    }
    if (damping < kNewtonDamping) damping = stable ? kNeutral : kNewtonDamping;
    double size = 0.0;
    int trial = 0;
    for (; trial < kMaxTrials; ++trial, damping = std::max(4.0 * damping, kNewtonDamping)) {
      if (!factor(rod, K_, damping)) continue;
      change_ = -r_;
      cholesky_.solve(change_.data());
      size = change_.lpNorm<Eigen::Infinity>();
      if (!(size <= kMaxChange)) continue;
      next_ = q + change_;
      if (!rod.is_admissible(next_.data())) continue;
      rod.static_residual(next_.data(), loads, work_, r_next_);
      if (size <= 1e2 * tolerance || change_.dot(r_ + r_next_) < 0.0)
        break;  // the potential falls, or rounding hides it
    }
    if (trial == kMaxTrials) break;
    q = next_;
    r_ = r_next_;
    if (stable && damping <= kNeutral && size <= tolerance) return {};
    damping *= 0.25;
  }
  return core::Status::discard("no stable equilibrium found", "reduce the loads, or their change in one step");
}

}  // namespace rod
