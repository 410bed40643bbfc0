// Damped Newton iteration and homotopy for one stage.
#include "integration/newton.hpp"

#include <cmath>

namespace rod {

namespace {

constexpr int kMaxIterations = 40;            // of one solve; convergence takes 3 to 6
constexpr double kMaxCorrection = 1.0;        // of a strain coefficient [1]: about a radian, or a stretch of 100 %
constexpr double kMinDamping = 1.0 / 1024.0;  // share of a correction below which backtracking gives up

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

NewtonResult Newton::iterate(const Rod& rod, const Stage& stage, const Loads& loads, double tolerance, Vector& x) {
  NewtonResult result;
  residual(rod, stage, loads, x);
  double size = merit(rod, r_);
  while (result.iterations < kMaxIterations && std::isfinite(size)) {
    ++result.iterations;
    rod.tangent(work, stage.weights, J_);
    lu_.compute(J_);
    change_ = lu_.solve(r_);
    result.correction = stage.weights.q * change_.lpNorm<Eigen::Infinity>();
    if (!std::isfinite(result.correction)) return result;

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
    if (damping == 1.0 && result.correction <= tolerance) {
      result.converged = true;
      return result;
    }
  }
  return result;
}

NewtonResult Newton::solve(const Rod& rod, const Stage& stage, const Loads& loads, double tolerance, Vector& x) {
  target_.setZero(rod.unknowns());
  return iterate(rod, stage, loads, tolerance, x);
}

NewtonResult Newton::solve_linear(const Rod& rod, const Stage& stage, const Loads& loads, Vector& x) {
  target_.setZero(rod.unknowns());
  residual(rod, stage, loads, x);
  rod.tangent(work, stage.weights, J_);
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

void Newton::equilibrium_velocity(const Rod& rod, const Loads& loads, const Loads& rates, Vector& v) {
  rod.load_derivative(work, loads, rates, r_);
  v = lu_.solve(r_);  // factored at the last iterate, which differs from the solution by less than the tolerance
  v = -v;
}

}  // namespace rod
