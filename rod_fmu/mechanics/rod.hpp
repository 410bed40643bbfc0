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
#include <memory>
#include <vector>

#include "core/status.hpp"
#include "mechanics/loops.hpp"
#include "physics/data.hpp"
#include "physics/frame.hpp"
#include "physics/loads.hpp"
#include "physics/tca_law.hpp"

namespace rod {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;
using ConstVectorRef = Eigen::Ref<const Vector>;

/// The same of one segment: also its strains, and the tensions along TCAs that are bonded to it.
struct SegmentWorkspace : Kinematics {
  VectorField kappa, lambda;                   // kappa times the segment's length
  std::vector<ScalarField> N, N_stretch, N_T;  // tension [N], its slopes in |u| [N] and in T [N/K]
};

/// Derivatives of one segment in the motion of its start, 12 numbers, and in the wrench at its end, 6 numbers: of its
/// residual, of the motion of its end, of the wrench at its start.
struct SegmentDerivatives {
  Matrix r_start, r_end;
  Eigen::Matrix<double, 12, 12> motion;
  Eigen::Matrix<double, 6, 12> base_start;
  Eigen::Matrix<double, 6, 6> base_end;
};

/// Scratch of one evaluation: what an evaluation leaves for derivatives and outputs. Never part of a state.
struct Workspace : Kinematics {
  PerTca<double> delta{};                  // displacements [m], Eq. 17
  PerTca<Tension> tension{};               // tensions [N] and their slopes, Eq. 4
  std::vector<Vector> b;                   // d delta_i/dq [m]
  std::vector<SegmentWorkspace> segments;  // of a body of segments, which does not use the Kinematics above
  PerTca<double> twist{};                  // of tethered TCAs: rotation of the ends about the TCA phi_i [rad]
  std::vector<Vector> c;                   // d phi_i/dq [1]
  PerTca<TetheredForce> tethered{};        // their tension and torque
  Wrench base;                             // that the body passes on to the clamp
  Vec3 gravity;                            // that acted, in the rod's frame [m/s2]
  long evaluations = 0;                    // of the residual in this workspace so far
  mutable std::vector<SegmentDerivatives> neighbours;  // scratch of the tangent
  mutable Vector scratch;                              // unknowns() numbers
  Vector balance;                                      // scratch of outputs: unknowns() numbers
};

/// Stages of the kinematics, one bit each: positions; displacements and tensions of the TCAs; velocities. `at_rest`:
/// positions and TCAs in one loop, where both are needed in any case.
namespace stage {
inline constexpr unsigned positions = 1, tcas = 2, velocities = 4, all = positions | tcas | velocities;
inline constexpr unsigned in_one_loop = 8, at_rest = in_one_loop | positions | tcas;
}  // namespace stage

/// Weights of the three derivatives: q dr/dq + v dr/dv + a dr/da.
struct Weights {
  double q = 0.0, v = 0.0, a = 0.0;
};

/// Constant after construction, but for the creep of its TCAs. Arrays of doubles have unknowns() elements.
class Rod {
 public:
  virtual ~Rod() = default;

  int unknowns() const { return static_cast<int>(stiffness_.size()); }
  /// Copies unknowns to the coefficients of the largest segments: segment by segment, degree by degree, six components
  /// in the fixed frame each. Coefficients that this rod lacks become 0.
  virtual void to_states(const double* unknowns, double* states) const = 0;
  /// The inverse of to_states(); coefficients that this rod lacks are ignored.
  virtual void from_states(const double* states, double* unknowns) const = 0;

  /// Writes the residual r(q, v, a) [J] and fills the workspace for the functions below.
  virtual void residual(const double* q, const double* v, const double* a, const Loads& loads, Workspace& work,
                        Vector& r) const = 0;
  /// Writes the residual of a rod at rest and fills the workspace for the functions below.
  virtual void static_residual(const double* q, const Loads& loads, Workspace& work, Vector& r) const = 0;
  /// Fills the workspace with these stages of the kinematics.
  virtual void kinematics(const double* q, const double* v, const Loads& loads, Workspace& work,
                          unsigned stages = stage::all) const = 0;
  /// Stages that outputs() of these parts needs, and spatial_error() at an equilibrium.
  virtual unsigned stages_of(unsigned parts) const = 0;

  // Derivatives at the point of the workspace's last residual:
  /// Writes J = weights.q dr/dq + weights.v dr/dv + weights.a dr/da, exact.
  virtual void tangent(const Workspace& work, const Weights& weights, Matrix& J) const = 0;
  /// Writes the derivative of r in the direction (0, dv, da).
  virtual void rate_derivative(const Workspace& work, const Vector& dv, const Vector& da, Vector& dr) const = 0;
  /// Writes dr/dt at fixed q, v, a under loads that change at `rates`.
  virtual void load_derivative(const Workspace& work, const Loads& loads, const Loads& rates, Vector& dr) const = 0;
  /// Adds to the static tangent J the stiffness of tensions that follow this rod's displacements where they do not in J
  /// (closure exchanged): J is then that of the closed loop.
  void add_tca_stiffness(const Workspace& work, const Loads& loads, Matrix& J) const;
  /// Returns whether that stiffness is positive semidefinite: no tension falls as its TCA lengthens.
  bool has_stiff_tcas(const Workspace& work, const Loads& loads) const;

  /// Returns whether the strains are finite, keep every section outside of its neighbours (stretch > 0), and have a
  /// curvature that the quadrature resolves.
  bool is_admissible(const double* q) const;
  /// The same as a status, with the strain that is not admissible.
  core::Status check_strains(const double* q) const;
  /// Refuses rates of the strains that waves in this rod never reach, as an explicit method with too long a step makes
  /// them.
  core::Status check_rates(const double* v) const;

  /// Estimates the error of the strain polynomials at an equilibrium [m]: of the centreline and of the displacements.
  /// The workspace holds its kinematics.
  virtual double spatial_error(const double* q, const Loads& loads, Workspace& work) const = 0;
  /// Estimates the same error [m] for a moving rod, from the decay of the strains' coefficients.
  virtual double spatial_error(const double* q) const = 0;

  /// Diagonal of int Phi^T K Phi ds [J].
  const Vector& stiffness() const { return stiffness_; }
  /// Writes the damping force int Phi^T D Phi ds v [J].
  virtual void damping_force(ConstVectorRef v, Vector& force) const = 0;
  /// Power of the damping at the rates v [W].
  virtual double damping_power(ConstVectorRef v) const = 0;
  /// Estimate of the first angular frequency of the slender clamped-free beam [rad/s], the scale of rates against
  /// strains.
  double first_frequency() const { return first_frequency_; }

  /// Writes these parts of the outputs but for `clamp` and `spatial_error`. The workspace holds their stages at the
  /// same q, v and loads, by kinematics(); residual() leaves out TCAs that are slack.
  virtual void outputs(const double* q, const double* v, const Loads& loads, Workspace& work, Outputs& y,
                       unsigned parts = part::motion) const = 0;
  /// Writes the force [N] and moment [N m] of the clamp on the rod for the workspace's last evaluation, which must have
  /// been residual() or static_residual().
  virtual void clamp_reaction(const Loads& loads, const Workspace& work, Outputs& y) const = 0;

  std::size_t tcas() const { return laws_.size(); }
  const TcaLaw& law(std::size_t i) const { return laws_[i]; }
  /// Sets what the law of TCA i knows of its creep (TcaLaw::set_creep).
  void set_creep(std::size_t i, double base, double span) { laws_[i].set_creep(base, span); }
  Closure closure() const { return closure_; }
  double length() const { return length_; }

 protected:
  explicit Rod(const Parameters& p);

  struct StrainRange {
    double curvature = 0.0;      // largest |kappa| times the segment's length [rad]
    double max_curvature = 0.0;  // that the segment's quadrature resolves [rad]
    double stretch = 1.0;        // least lambda_z [1]
  };
  /// Extremes of the strains at the nodes; of several segments the one that is closest to its limit.
  virtual StrainRange strain_range(const double* q) const = 0;
  /// Tensions of the TCAs from their displacements (Eq. 4).
  void pull_tcas(const Loads& loads, Workspace& work) const;
  /// Writes the outputs of the TCAs.
  void tca_outputs(const double* v, const Loads& loads, const Workspace& work, Outputs& y) const;
  /// Energy of the TCAs [J].
  double tca_energy(const Loads& loads, const Workspace& work) const;

  Frame frame_;  // of a planar rod: its x axis lies in the plane of motion
  std::vector<TcaLaw> laws_;
  bool has_slack_tcas_ = false;  // all of them are, so that none acts on the body
  Closure closure_ = Closure::inside;
  double length_ = 0.0;
  double first_frequency_ = 0.0;
  double wave_rate_ = 0.0;  // speed of the fastest waves along the rod, TCAs included, over its length [1/s]
  Vector stiffness_;
};

/// The strain components of a choice of strains, 0..2: bending, bending, torsion; 3..5: shear, shear, stretch. Of a
/// planar rod those that stay in the plane, and in `excluded` the others.
std::vector<int> components_of(Strains strains, bool planar, std::vector<int>& excluded);

/// Estimate of what strain polynomials with these coefficients leave out of the centreline, over the length [1].
double missing_share(const double* q, int terms, const std::vector<int>& components);

/// Returns whether UniformRod can be the rod of these parameters.
bool is_uniform(const Parameters& p);

/// The rod of these parameters: uniform where it can be, else of segments.
std::unique_ptr<Rod> make_rod(const Parameters& p);

}  // namespace rod
