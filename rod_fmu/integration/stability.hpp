// Stability of equilibria, and the overdamped motion from a given shape to a stable one.
//
// An equilibrium r(q) = 0 is stable if the symmetric part of its tangent K = dr/dq is positive definite: for
// conservative loads K is symmetric up to discretisation, and a Cholesky factorisation decides. A dead moment at the
// tip is not conservative; the eigenvalues of M^-1 K then must all have a positive real part.
#pragma once

#include "core/status.hpp"
#include "integration/newton.hpp"
#include "mechanics/rod.hpp"

namespace rod {

/// Returns whether a dead moment acts at the tip, so that the loads have no potential.
bool has_moment(const Loads& loads);

class Stability {
 public:
  /// Returns whether the equilibrium q [1] that `newton` found is stable. A rod whose displacements are exchanged is
  /// judged with tensions that follow them, as in the closed loop that it is part of: under dead tensions alone it may
  /// buckle where the manipulator does not.
  bool is_stable(const Rod& rod, const Vector& q, const Loads& loads, const Newton& newton);

  /// Moves q [1] along the overdamped motion dq/dt = -K0^-1 r(q), K0 the stiffness of the body, until it rests at a
  /// stable equilibrium. Linearly implicit Euler steps that lower the potential, with lengths that grow as the motion
  /// slows down; the last ones are Newton steps. Near an unstable equilibrium the slow start of the motion is
  /// skipped, see departure(). Where this fails, as under a load along the axis that would crush the straight rod
  /// before it rests, a symmetric motion departs at once.
  core::Status descend(const Rod& rod, const Loads& loads, double tolerance, Vector& q);

  /// What is doubtful about the last equilibrium.
  enum class Doubt {
    none,
    ambiguous,  // descend() left an unstable equilibrium in an arbitrary direction
    unstable    // it is unstable under a dead moment, and the motion from it does not come to rest
  };
  Doubt doubt() const { return doubt_; }
  void set_doubt(Doubt doubt) { doubt_ = doubt; }

  /// Evaluations of the residual so far.
  long evaluations() const { return work_.evaluations; }

 private:
  /// Factors the symmetric part of K with `damping` times the stiffness added; false where it is not positive definite.
  bool factor(const Rod& rod, const Matrix& K, double damping);
  bool is_clearly_stable(const Rod& rod, const Loads& loads, const Newton& newton);

  enum class Leave { at_rest, at_once };  // when a symmetric motion may depart
  core::Status fall(const Rod& rod, const Loads& loads, double tolerance, Leave leave, Vector& q);

  enum class Departure { none, chosen, ambiguous };
  /// Near an equilibrium that is unstable, writes the change of q [1] by the linear motion along the growing modes of
  /// the tangent K_ under the residual r_: the loads choose the direction, however small their share along these modes.
  /// Where they have none the change is along the fastest mode: ambiguous. `none`: not at rest, or nothing grows.
  Departure departure(const Rod& rod, Leave leave, Vector& change) const;

  Workspace work_;
  Matrix K_;
  Cholesky cholesky_;
  Vector r_, r_next_, change_, next_;
  Doubt doubt_ = Doubt::none;
};

}  // namespace rod
