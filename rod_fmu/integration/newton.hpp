// Newton's method for one stage: find x with r(q + wq x, v + wv x, a + wa x) = 0, damped by backtracking, and helped by
// homotopy where the start is far. Statics is the stage with wv = wa = 0 and no velocities.
#pragma once

#include <Eigen/LU>

#include "mechanics/rod.hpp"

namespace rod {

/// A point that the unknown x moves: at x = 0 (q, v, a), along x by the weights.
struct Stage {
  Vector q, v, a;
  Weights weights;
  bool moving = true;
};

struct NewtonResult {
  bool converged = false;
  int iterations = 0;
  double correction = 0.0;  // the last one, largest component, dimensionless strain
};

/// Workspace for solves with this rod; no allocation after construction.
class Newton {
 public:
  /// Solves from x (in and out). `tolerance` bounds the last correction of the strains. On failure x is unspecified.
  NewtonResult solve(const Rod& rod, const Stage& stage, const Loads& loads, double tolerance, Vector& x);

  /// As solve, but when Newton fails from x it follows r - (1 - s) r(x) = 0 from s = 0 to 1.
  NewtonResult solve_far(const Rod& rod, const Stage& stage, const Loads& loads, double tolerance, Vector& x);

  /// For a stage in which r is linear in x: one step.
  NewtonResult solve_linear(const Rod& rod, const Stage& stage, const Loads& loads, Vector& x);

  /// The rate v of a solution just found by solve() or solve_far() of statics, for loads that change: K v = -dr/dt.
  void drift(const Rod& rod, const Loads& loads, const Loads& rates, Vector& v);

  Work work;  // of the last residual evaluated

 private:
  void residual(const Rod& rod, const Stage& stage, const Loads& loads, const Vector& x);
  NewtonResult iterate(const Rod& rod, const Stage& stage, const Loads& loads, double tolerance, Vector& x);

  Vector q_, v_, a_, r_, target_, trial_, change_;
  Matrix J_;
  Eigen::PartialPivLU<Matrix> lu_;
};

}  // namespace rod
