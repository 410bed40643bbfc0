// A Cosserat rod with embedded TCAs as a system of few unknowns: strains are polynomials along the rod,
//   xi(s, t) = xi* + Phi(s) q(t),   xi = [kappa; lambda],
// and the equations of motion are the projection of the rod's balance (Eqs. 5-16, body frame: Eq. 8) onto Phi,
//   r(q, v, a) = int Phi^T (K Phi q + D Phi v + sum N_i [r_i x t_i; t_i] - [R^T m; R^T n]) ds = 0,
//   n(s) = F + int_s^L rho A (g - p..) ds,   m(s) = M + int_s^L (p' x n - h.) ds,   h = R rho J R^T omega,
// with q dimensionless (curvatures times L), r in joules, v = q., a = q... . Everything but R(s) is one integral over
// s, so the exact derivative of r is the same chain of integrals again.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "mechanics/loops.hpp"
#include "physics/data.hpp"
#include "physics/loads.hpp"
#include "physics/section.hpp"
#include "physics/tca_law.hpp"

namespace rod {

inline constexpr int max_unknowns = 6 * max_terms;
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max_unknowns, 1>;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, max_unknowns, max_unknowns>;

/// Scratch of one evaluation: what residual() leaves for derivatives and outputs. Never part of a state.
struct Work : Kinematics {
  PerTca<double> delta{};           // m
  PerTca<Tension> tension{};        // N
  std::array<Vector, tca_count> b;  // d delta_i/dq [m]
};

/// Weights of the three derivatives: weight.q dr/dq + weight.v dr/dv + weight.a dr/da.
struct Weights {
  double q = 0.0, v = 0.0, a = 0.0;
};

/// Constant after construction, but for the count of its evaluations.
class Rod {
 public:
  Rod() = default;
  explicit Rod(const Parameters& p) : Rod(p, Section::of(p)) {}
  Rod(const Parameters& p, const Section& section);

  int unknowns() const { return build_.unknowns(); }
  /// Coefficients of the strains as they stand among those of the largest rod, degree by degree, six components in the
  /// fixed frame each; and back. What this rod lacks is 0, and is ignored.
  void to_states(const double* unknowns, double* states) const;
  void from_states(const double* states, double* unknowns) const;

  /// r(q, v, a) [J]. Statics when v and a are null. Fills work for the calls below.
  void residual(const double* q, const double* v, const double* a, const Loads& loads, Work& work, Vector& r) const;
  /// How often residual() was called.
  long evaluations() const { return evaluations_; }
  /// Positions, velocities, displacements and tensions: what of work outputs() needs.
  void look(const double* q, const double* v, const Loads& loads, Work& work) const;
  /// The exact derivative at the point of the last residual().
  void tangent(const Work& work, const Weights& weights, Matrix& J) const;
  /// The derivative in the direction (0, dv, da).
  void rate_derivative(const Work& work, const Vector& dv, const Vector& da, Vector& dr) const;
  /// dr/dt at fixed q, v, a for changing loads.
  void load_derivative(const Work& work, const Loads& loads, const Loads& rates, Vector& dr) const;

  /// Diagonals of int Phi^T K Phi [J] and of int Phi^T D Phi [J s].
  const Vector& stiffness() const { return stiffness_; }
  const Vector& damping() const { return damping_; }
  /// Angular frequency that scales velocities against strains: the slender clamped-free beam's first [rad/s].
  double first_frequency() const;

  /// Positions at the evenly spaced stations, tip pose and velocity, energies, displacements and tensions, for the
  /// state of the last look() or residual().
  void outputs(const double* q, const double* v, const Loads& loads, const Work& work, Outputs& y) const;

  const TcaLaw& law() const { return law_; }
  double length() const { return build_.length; }

 private:
  /// What a strain component, constant along the rod and dimensionless, costs: int K ds in units of the unknowns [J].
  double stiffness_per_strain(int c) const {
    return section_.stiffness[c] * (c < 3 ? 1.0 / length() : length());  // curvatures are kept times L
  }
  /// The loop over nodes, and what the TCAs make of it; r may be null.
  void go_along(const double* q, const double* v, const double* a, const Loads& loads, Work& work, double* r) const;
  /// See Outputs::out_of_plane; loads are those of the fixed frame.
  double out_of_plane(const Loads& loads, const Work& work) const;

  Frame frame_;  // where a planar rod moves
  Section section_;
  TcaLaw law_;
  Closure closure_ = Closure::inside;
  std::vector<int> components_, left_out_;  // of the strains: those here, and those that would leave the plane
  Build build_;
  ResidualLoop residual_ = nullptr;
  TangentLoop tangent_ = nullptr;
  RateLoop rates_ = nullptr;
  PerTca<double> reference_path_{};  // int |u_i| ds/L of the unstrained rod
  Vector stiffness_, damping_;
  mutable long evaluations_ = 0;
};

}  // namespace rod
