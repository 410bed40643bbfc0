// Damped Newton iteration and homotopy for one stage.
#include "integration/newton.hpp"

#include <cmath>

namespace rod {

namespace {

constexpr int kMaxIterations = 40;            // of one solve; convergence takes 3 to 6
constexpr double kMaxCorrection = 1.0;        // of a strain coefficient [1]: about a radian, or a stretch of 100 %
constexpr double kMinDamping = 1.0 / 1024.0;  // share of a correction below which backtracking gives up
constexpr int kMaxChordSteps = 8;             // with one tangent
constexpr double kMaxContraction = 0.05;      // of a chord step: slower ones cost more than a fresh tangent
constexpr double kChordError = 1e-12;         // of the strains behind the last chord step, estimated [1]
constexpr double kSmallCorrection = 1e-7;     // of statics, by a fresh tangent [1]: its square is the error behind it
constexpr double kCloseTangent = 1e-7;        // distance [1], or share left out, of a tangent that is as good as exact
constexpr double kSymmetric = 1e-4;           // largest share of a tangent that is not symmetric, for Cholesky's method
constexpr int kMaxRefinements = 6;            // of a velocity with one tangent
constexpr double kVelocityError = 1e-9;       // behind the last of them, relative; differences are good for 1e-10
constexpr double kDifference = 1e-5;          // of strain coefficients [1], for central differences of the residual

/// Squared norm of the residual, each equation divided by its own stiffness.
double merit(const Rod& rod, const Vector& r) { return (r.array() / rod.stiffness().array()).square().sum(); }

}  // namespace

void Newton::reserve(int unknowns) {
  for (Vector* each : {&q_, &v_, &a_, &r_, &target_, &trial_, &change_, &start_}) each->resize(unknowns);
  J_.resize(unknowns, unknowns);
  lu_ = Eigen::PartialPivLU<Matrix>(unknowns);
}

void Newton::residual(const Rod& rod, const Stage& stage, const Loads& loads, const Vector& x) {
  q_ = stage.q + stage.weights.q * x;
  if (stage.moving) {
    v_ = stage.v + stage.weights.v * x;
    a_ = stage.a + stage.weights.a * x;
    rod.residual(q_.data(), v_.data(), a_.data(), loads, work, r_);
  } else {
    rod.static_residual(q_.data(), loads, work, r_);
  }
  r_ -= target_;
}

/// Factors J_: by Cholesky's method where it is the tangent of statics under loads with a potential, which is symmetric
/// but for the discretisation. Chord steps make good what the symmetric part leaves out.
void Newton::factor(const Stage& stage) {
  is_by_cholesky_ = false;
  left_out_ = 0.0;
  if (!stage.moving) {
    const double left_out = cholesky_.assign(J_.data(), static_cast<int>(J_.rows()));
    is_by_cholesky_ = left_out <= kSymmetric && cholesky_.factor();
    if (is_by_cholesky_) left_out_ = left_out;
  }
  if (!is_by_cholesky_) lu_.compute(J_);
}

void Newton::solve_factored(const Vector& right, Vector& x) {
  if (is_by_cholesky_) {
    x = right;
    cholesky_.solve(x.data());
  } else {
    x = lu_.solve(right);
  }
}

NewtonResult Newton::iterate(const Rod& rod, const Stage& stage, const Loads& loads, double tolerance, Vector& x) {
  NewtonResult result;
  residual(rod, stage, loads, x);
  double size = merit(rod, r_);
  while (result.iterations < kMaxIterations && std::isfinite(size)) {
    ++result.iterations;
    rod.tangent(work, stage.weights, J_);
    factor(stage);
    solve_factored(r_, change_);
    result.correction = stage.weights.q * change_.lpNorm<Eigen::Infinity>();
    if (!std::isfinite(result.correction)) return result;

    if (!stage.moving && result.correction <= kSmallCorrection) {
      x -= change_;
      tangent_distance_ = result.correction;
      result.converged = true;
      return result;
    }
    double damping = std::min(1.0, kMaxCorrection / result.correction);
    for (;; damping *= 0.5) {
      trial_ = x - damping * change_;
      residual(rod, stage, loads, trial_);
      const double trial_size = merit(rod, r_);
      if (trial_size <= (1.0 - 1e-4 * damping) * size || result.correction <= tolerance) {
        x = trial_;
        size = trial_size;
        break;
      }
      if (damping < kMinDamping) return result;
    }
    tangent_distance_ = damping * result.correction;
    if (damping < 1.0) continue;
    if (result.correction <= tolerance || (!stage.moving && take_chord_steps(rod, stage, loads, result, x))) {
      result.converged = true;
      return result;
    }
    size = merit(rod, r_);
  }
  return result;
}

/// Corrects x with the tangent at hand while that contracts well. Returns whether x has converged; if not, r_ is the
/// residual at x. Behind a correction c that is the share s of the one before, chord steps leave about 2 s c: the
/// tangent was taken at the start of the first correction, which the Newton step halves to second order.
bool Newton::take_chord_steps(const Rod& rod, const Stage& stage, const Loads& loads, NewtonResult& result, Vector& x) {
  for (int step = 0; step < kMaxChordSteps; ++step) {
    solve_factored(r_, change_);
    const double correction = stage.weights.q * change_.lpNorm<Eigen::Infinity>();
    const double contraction = correction / result.correction;
    if (!(contraction <= kMaxContraction)) return false;
    x -= change_;
    result.correction = correction;
    ++result.iterations;
    if (2.0 * contraction * correction <= kChordError) return true;
    residual(rod, stage, loads, x);
  }
  return false;
}

NewtonResult Newton::solve(const Rod& rod, const Stage& stage, const Loads& loads, double tolerance, Vector& x) {
  target_.setZero(rod.unknowns());
  return iterate(rod, stage, loads, tolerance, x);
}

NewtonResult Newton::solve_linear(const Rod& rod, const Stage& stage, const Loads& loads, Vector& x) {
  target_.setZero(rod.unknowns());
  residual(rod, stage, loads, x);
  rod.tangent(work, stage.weights, J_);
  is_by_cholesky_ = false;
  lu_.compute(J_);
  change_ = lu_.solve(r_);
  x -= change_;
  return {.converged = x.allFinite(), .iterations = 1};
}

NewtonResult Newton::solve_with_homotopy(const Rod& rod, const Stage& stage, const Loads& loads, double tolerance,
                                         Vector& x) {
  start_ = x;
  NewtonResult result = solve(rod, stage, loads, tolerance, x);
  if (result.converged) return result;

  Vector full_residual, solution = start_;
  residual(rod, stage, loads, start_);  // target_ is null here
  full_residual = r_;
  double done = 0.0, step = 0.25;  // of the homotopy parameter s
  while (done < 1.0 && step > 1e-4) {
    const double next = std::min(1.0, done + step);
    target_ = (1.0 - next) * full_residual;
    x = solution;
    const NewtonResult part = iterate(rod, stage, loads, tolerance, x);
    result.iterations += part.iterations;
    result.correction = part.correction;
    if (part.converged) {
      solution = x;
      done = next;
      step *= 2.0;
    } else {
      step *= 0.25;
    }
  }
  result.converged = done >= 1.0;
  return result;
}

void Newton::equilibrium_velocity(const Rod& rod, const Vector& q, const Loads& loads, const Loads& rates, Vector& v) {
  equilibrium_velocity(rod, q, loads, rates, v, [](Vector&) {});
}

/// Solves K v = -target_ at the equilibrium q with the tangent at hand; where that belongs to a point farther away, the
/// solution is refined with K v from central differences, or the tangent is taken anew where that does not contract.
void Newton::solve_velocity(const Rod& rod, const Vector& q, const Loads& loads, Vector& v) {
  solve_factored(target_, v);
  v = -v;
  double size = v.lpNorm<Eigen::Infinity>(), before = size;
  if ((tangent_distance_ <= kCloseTangent && left_out_ <= kCloseTangent) || size == 0.0) return;
  for (int pass = 0; pass < kMaxRefinements && std::isfinite(size) && size > 0.0; ++pass) {
    const double step = kDifference / size;
    q_ = q + step * v;
    rod.static_residual(q_.data(), loads, work, r_);
    q_ = q - step * v;
    rod.static_residual(q_.data(), loads, work, trial_);
    r_ = target_ + (0.5 / step) * (r_ - trial_);
    solve_factored(r_, change_);
    const double correction = change_.lpNorm<Eigen::Infinity>();
    if (!(correction <= kMaxContraction * before)) break;
    v -= change_;
    size = v.lpNorm<Eigen::Infinity>();
    if (correction * correction <= kVelocityError * size * before) return;
    before = correction;
  }
  rod.static_residual(q.data(), loads, work, r_);
  rod.tangent(work, {.q = 1.0}, J_);
  is_by_cholesky_ = false;
  lu_.compute(J_);
  tangent_distance_ = 0.0;
  v = lu_.solve(target_);
  v = -v;
}

}  // namespace rod
