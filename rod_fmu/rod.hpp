// A Cosserat rod with embedded TCAs as a system of few unknowns: strains are polynomials along the rod,
//   xi(s, t) = xi* + Phi(s) q(t),   xi = [kappa; lambda],
// and the equations of motion are the projection of the rod's balance (physics: Eqs. 5-16, body frame) onto Phi,
//   r(q, v, a) = int Phi^T (K Phi q + D Phi v + sum N_i [r_i x t_i; t_i] - [R^T m; R^T n]) ds = 0,
//   n(s) = F + int_s^L rho A (g - p..) ds,   m(s) = M + int_s^L (p' x n - h.) ds,   h = R rho J R^T omega,
// with q dimensionless (curvatures times L), r in joules, v = q., a = q... . Everything but R(s) is one integral over
// s, so the exact derivative of r is the same chain of integrals again.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "data.hpp"
#include "field.hpp"
#include "loads.hpp"
#include "quadrature.hpp"
#include "tca.hpp"

namespace rod {

inline constexpr int max_unknowns = 6 * max_terms;
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max_unknowns, 1>;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, max_unknowns, max_unknowns>;

/// Cross-section, body frame, [angular; linear] as everywhere.
struct Section {
  std::array<double, 6> stiffness{};                  // N m^2 (3), N (3)
  double retardation = 0.0;                           // s, damping = retardation * stiffness
  double mass = 0.0;                                  // kg/m
  Vec3 inertia;                                       // kg m, rotary inertia per length
  std::array<double, 6> reference{0, 0, 0, 0, 0, 1};  // xi*, 1/m and 1

  static Section of(const Parameters& p);
};

/// Scratch of one evaluation: what residual() leaves for derivatives and outputs. Never part of a state.
struct Work {
  RotationField R;
  Field l, n, m;                               // p'/L, force n L, moment m
  Field k1, k2, l1, l2;                        // R kappa. L, R kappa.. L, R lambda., R lambda..
  Field omega, alpha, omega_body, hdot;        // hdot scaled by L
  Field velocity, acceleration;                // over L
  std::array<Field, tca_count> t, arm;         // tangent of TCA i, its arm r_i x t_i over L
  std::array<Lane, tca_count> inverse_length;  // 1/|u_i|
  PerTca<double> delta{};                      // m
  PerTca<Tension> tension{};                   // N
  std::array<Vector, tca_count> b;             // d delta_i/dq [m]
  std::array<double, 4> tip_quaternion{};
  bool moving = false;
};

/// Weights of the three derivatives: weight.q dr/dq + weight.v dr/dv + weight.a dr/da.
struct Weights {
  double q = 0.0, v = 0.0, a = 0.0;
};

/// Constant after construction.
class Rod {
 public:
  Rod() = default;
  explicit Rod(const Parameters& p) : Rod(p, Section::of(p)) {}
  Rod(const Parameters& p, const Section& section);

  int unknowns() const { return static_cast<int>(components_.size()) * terms_; }
  /// Where unknown k stands among those of the largest rod: degree by degree, six components each.
  int place(int k) const {
    const int count = static_cast<int>(components_.size());
    return k / count * 6 + components_[k % count];
  }

  /// r(q, v, a) [J]. Statics when v and a are null. Fills work for the calls below.
  void residual(const double* q, const double* v, const double* a, const Loads& loads, Work& work, Vector& r) const;
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
  /// state of the last residual().
  void outputs(const double* q, const double* v, const Loads& loads, const Work& work, Outputs& y) const;

  const TcaLaw& law() const { return law_; }
  double length() const { return length_; }

 private:
  struct Strain {
    Field kappa, lambda;
  };
  struct Variation {
    Strain q, v, a;
  };
  void expand(const double* coefficients, Strain& strain) const;
  void rotations(const double* q, Work& work) const;
  void displacements(const Strain& strain, Work& work) const;
  void project(const Field& couple, const Field& force, double sign, double* r) const;
  /// The variation of [R^T m; R^T n]; `angular` where d contains curvatures.
  void vary(const Work& work, const Variation& d, bool angular, Field& couple, Field& force) const;

  double length_ = 0.0;
  int terms_ = 0;
  std::vector<int> components_;
  Section section_;
  TcaLaw law_;
  Closure closure_ = Closure::inside;
  std::array<Field, tca_count> offset_, slope_;  // r_i/L and dr_i/ds at the nodes
  PerTca<double> reference_length_{};            // int |u_i| ds/L of the unstrained rod
  Vector stiffness_, damping_;
};

}  // namespace rod
