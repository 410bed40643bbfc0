// A Cosserat rod with embedded TCAs as a system of few unknowns. The strains are polynomials along the rod,
//   xi(s, t) = xi* + Phi(s) q(t),   xi = [kappa; lambda],
// and the equations of motion are the projection of the rod's balance (Eq. 8 with the law of the section, Eqs. 9-13,
// and the boundary conditions, Eqs. 15-16) onto Phi:
//   r(q, v, a) = int Phi^T (K Phi q + D Phi v + sum N_i [r_i x t_i; t_i] - [R^T m; R^T n]) ds = 0,
//   n(s) = F + int_s^L rho A (g - d2p/dt2) ds,   m(s) = M + int_s^L (p' x n - dh/dt) ds,   h = R rho J R^T omega.
// The TCAs' terms are Eq. 14 with N the tension; N_i follows from delta_i = int |u_i| ds - L_i (Eq. 17) by the TCA law
// (Eq. 4), with delta_i that of the rod itself or a given one (closure, Eqs. 18-20).
// Units: q dimensionless (curvatures times L), r in joules, v = dq/dt [1/s], a = dv/dt [1/s2].
// Everything but R(s) is one integral over s, so the exact derivative of r is the same chain of integrals again.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/status.hpp"
#include "mechanics/loops.hpp"
#include "physics/data.hpp"
#include "physics/loads.hpp"
#include "physics/section.hpp"
#include "physics/tca_law.hpp"

namespace rod {

inline constexpr int kMaxUnknowns = 6 * kMaxTerms;
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxUnknowns, 1>;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxUnknowns, kMaxUnknowns>;

/// Scratch of one evaluation: what an evaluation leaves for derivatives and outputs. Never part of a state.
struct Workspace : Kinematics {
  PerTca<double> delta{};       // displacements [m], Eq. 17
  PerTca<Tension> tension{};    // tensions [N] and their slopes, Eq. 4
  std::array<Vector, kTcas> b;  // d delta_i/dq [m]
  long evaluations = 0;         // of the residual in this workspace so far
};

/// Weights of the three derivatives: q dr/dq + v dr/dv + a dr/da.
struct Weights {
  double q = 0.0, v = 0.0, a = 0.0;
};

/// Constant after construction. Arrays of doubles have unknowns() elements.
class Rod {
 public:
  Rod() = default;
  explicit Rod(const Parameters& p) : Rod(p, Section::of(p)) {}
  Rod(const Parameters& p, const Section& section);

  int unknowns() const { return constants_.unknowns(); }
  /// Copies unknowns to the coefficients of the largest rod: degree by degree, six components in the fixed frame each.
  /// Coefficients that this rod lacks become 0.
  void to_states(const double* unknowns, double* states) const;
  /// The inverse of to_states(); coefficients that this rod lacks are ignored.
  void from_states(const double* states, double* unknowns) const;

  /// Writes the residual r(q, v, a) [J] and fills the workspace for the functions below.
  void residual(const double* q, const double* v, const double* a, const Loads& loads, Workspace& work,
                Vector& r) const;
  /// Writes the residual of a rod at rest and fills the workspace for the functions below.
  void static_residual(const double* q, const Loads& loads, Workspace& work, Vector& r) const;
  /// Fills the workspace with positions, velocities, displacements and tensions, enough for outputs().
  void kinematics(const double* q, const double* v, const Loads& loads, Workspace& work) const;

  // Derivatives at the point of the workspace's last residual:
  /// Writes J = weights.q dr/dq + weights.v dr/dv + weights.a dr/da, exact.
  void tangent(const Workspace& work, const Weights& weights, Matrix& J) const;
  /// Adds to the static tangent J the stiffness of tensions that follow this rod's displacements where they do not in J
  /// (closure exchanged): J is then that of the closed loop.
  void add_tca_stiffness(const Workspace& work, const Loads& loads, Matrix& J) const;
  /// Writes the derivative of r in the direction (0, dv, da).
  void rate_derivative(const Workspace& work, const Vector& dv, const Vector& da, Vector& dr) const;
  /// Writes dr/dt at fixed q, v, a under loads that change at `rates`.
  void load_derivative(const Workspace& work, const Loads& loads, const Loads& rates, Vector& dr) const;

  /// Returns whether the strains are finite, keep every section outside of its neighbours (stretch > 0), and have a
  /// curvature that the quadrature resolves.
  bool is_admissible(const double* q) const;
  /// The same as a status, with the strain that is not admissible.
  core::Status check_strains(const double* q) const;

  /// Estimates the error of the strain polynomials at an equilibrium [m]: of the centreline and of the displacements.
  /// The workspace holds its kinematics.
  double spatial_error(const double* q, const Loads& loads, const Workspace& work) const;
  /// Estimates the same error [m] for a moving rod, from the decay of the strains' coefficients.
  double spatial_error(const double* q) const;

  /// Diagonal of int Phi^T K Phi ds [J].
  const Vector& stiffness() const { return stiffness_; }
  /// Diagonal of int Phi^T D Phi ds [J s].
  const Vector& damping() const { return damping_; }
  /// First angular frequency of the slender clamped-free beam [rad/s], the scale of rates against strains.
  double first_frequency() const;

  /// Writes shape, tip pose and velocity, energies, displacements and tensions for the workspace's last evaluation,
  /// which must have been residual() or kinematics() at the same q, v and loads.
  void outputs(const double* q, const double* v, const Loads& loads, const Workspace& work, Outputs& y) const;

  const TcaLaw& law() const { return law_; }
  Closure closure() const { return closure_; }
  double length() const { return constants_.length; }

 private:
  /// Stiffness of a constant strain of component c, int K ds in units of the unknowns [J].
  double stiffness_per_strain(int c) const {
    return section_.stiffness[c] * (c < 3 ? 1.0 / length() : length());  // curvatures are multiplied by L
  }
  struct StrainRange {
    double curvature = 0.0;  // largest |kappa| L [rad]
    double stretch = 1.0;    // least lambda_z [1]
  };
  /// Extremes of the strains at the nodes.
  StrainRange strain_range(const double* q) const;
  /// Resizes the gradients b of the workspace and returns where a loop writes them.
  Gradients gradients(Workspace& work) const;
  /// Displacements and tensions of the TCAs from their paths (Eqs. 17 and 4).
  void pull_tcas(const Loads& loads, Workspace& work) const;
  /// See Outputs::out_of_plane; loads are those of the fixed frame.
  double out_of_plane(const Loads& loads, const Workspace& work) const;

  Frame frame_;  // of a planar rod: its x axis lies in the plane of motion
  Section section_;
  TcaLaw law_;
  Closure closure_ = Closure::inside;
  std::vector<int> components_;           // strain components of this rod
  std::vector<int> excluded_components_;  // those that would leave the plane of a planar rod
  RodConstants constants_;
  ResidualLoops residual_loops_;
  TangentLoops tangent_loops_;
  PerTca<double> reference_path_{};  // int |u_i| ds/L of the unstrained rod
  Vector stiffness_, damping_;
};

}  // namespace rod
