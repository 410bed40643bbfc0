// Newton's method for one stage: find x with r(q + wq x, v + wv x, a + wa x) = 0, damped by backtracking, with a
// homotopy from a far start. Statics is the stage with wv = wa = 0 and no velocities; there the last corrections share
// one factorised tangent (chord steps), since a residual costs a sixth of a tangent.
#pragma once

#include <Eigen/LU>

#include "mechanics/rod.hpp"
#include "numerics/cholesky.hpp"

namespace rod {

/// A point that moves with the unknown x: (q, v, a) at x = 0, by the weights along x.
struct Stage {
  Vector q, v, a;
  Weights weights;
  bool moving = true;  // false: statics, v and a are not used
};

struct NewtonResult {
  bool converged = false;
  int iterations = 0;
  double correction = 0.0;  // largest component of the last correction, as a strain [1]
};

/// Workspace for solves with one rod; no allocation after reserve() and a first evaluation.
class Newton {
 public:
  /// Makes room for that many unknowns.
  void reserve(int unknowns);

  /// Solves from x (in and out). `tolerance` bounds the last correction of the strains by a fresh tangent; statics end
  /// at an estimated error of 1e-12. On failure x is unspecified.
  NewtonResult solve(const Rod& rod, const Stage& stage, const Loads& loads, double tolerance, Vector& x);

  /// As solve(); where Newton's method fails from x, follows r - (1 - s) r(x) = 0 from s = 0 to 1.
  NewtonResult solve_with_homotopy(const Rod& rod, const Stage& stage, const Loads& loads, double tolerance, Vector& x);

  /// One step, for a stage in which r is linear in x.
  NewtonResult solve_linear(const Rod& rod, const Stage& stage, const Loads& loads, Vector& x);

  /// Writes the velocity v with which the equilibrium q moves under changing loads, K v = -dr/dt. The last call must
  /// have been a successful solve() or solve_with_homotopy() of statics that found q.
  void equilibrium_velocity(const Rod& rod, const Vector& q, const Loads& loads, const Loads& rates, Vector& v);
  /// The same where add(r_t) adds to the rate of the residual at fixed strains.
  template <class Add>
  void equilibrium_velocity(const Rod& rod, const Vector& q, const Loads& loads, const Loads& rates, Vector& v,
                            Add add) {
    rod.load_derivative(work, loads, rates, target_);
    add(target_);
    solve_velocity(rod, q, loads, v);
  }

  /// Symmetric part of the tangent of the last iteration of statics but chord steps.
  const Cholesky& symmetric_tangent() const { return cholesky_; }
  /// Distance from the point of that tangent to the solution: largest component [1].
  double tangent_distance() const { return tangent_distance_; }

  Workspace work;  // of the last residual

 private:
  void residual(const Rod& rod, const Stage& stage, const Loads& loads, const Vector& x);
  void factor(const Stage& stage);
  void solve_factored(const Vector& right, Vector& x);
  NewtonResult iterate(const Rod& rod, const Stage& stage, const Loads& loads, double tolerance, Vector& x);
  bool take_chord_steps(const Rod& rod, const Stage& stage, const Loads& loads, NewtonResult& result, Vector& x);
  void solve_velocity(const Rod& rod, const Vector& q, const Loads& loads, Vector& v);

  Vector q_, v_, a_, r_, target_, trial_, change_, start_;
  Matrix J_;
  Eigen::PartialPivLU<Matrix> lu_;
  Cholesky cholesky_;            // of a static tangent that is symmetric and positive definite
  bool is_by_cholesky_ = false;  // whether it holds the factors, not lu_
  double left_out_ = 0.0;        // share of the tangent that its factors leave out, since it is not symmetric
  double tangent_distance_ = 0.0;
};

}  // namespace rod
