// The paper's own scheme for the rod (Eqs. 21-25, corrected): pose, strain, velocity and eps' = |u| of every TCA on
// evenly spaced grid points, compact (Pade) derivatives of 4th order along the rod (Eq. 25), backward Euler in time
// (Eq. 24), and Newton's method on the whole system with the displacements delta as unknowns that must equal int |u| ds
// - L_i (Eq. 17; Eqs. 18-20).
//
// Rows of the compact scheme: eta' is known from the strain rate at all points but the tip, where the load determines
// the strain; W' from the acceleration at all points but the clamp, which does not move. So eta keeps its closure at
// the clamp and W its closure at the tip; the boundary conditions eta(0) = 0 and W(L) = W_tip (Eqs. 15-16) replace the
// others. With the opposite choice the rates follow from a recursion that grows like 3.7^n.
//
// eps' is integrated in time, as in the paper (Eq. 22, second row): each step adds t . (u - u_before), which differs
// from the change of |u| by the square of the angle that u rotates in the step relative to the section: first order in
// the step, the order of the scheme. The pose is integrated within a step by Eq. 22, first row (exponential of the body
// velocity, unit quaternions instead of Euler rates); the step ends with the pose that belongs to the strains, a
// difference of second order. Without that, pose and strain drift apart, and a rod at rest depends on its history.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "integration/integrator.hpp"
#include "mechanics/rod.hpp"
#include "pade/frontal_solver.hpp"
#include "pade/grid_state.hpp"
#include "physics/section.hpp"

namespace rod {

/// Work arrays for one rod on a grid. Never part of a state.
struct GridScratch {
  std::vector<pade::PreviousNode> before;
  std::vector<pade::NodeVector> z, change,
      accepted;  // iterate of Newton's method, its correction, the last converged point of the homotopy
  std::vector<pade::NodeEquations> node_equations;
  std::vector<pade::DifferenceRow> rows;
  pade::FrontalSolver solver;
  std::vector<double> backup;
  long evaluations = 0;  // of the residual at all points
};

/// Constant after construction.
class GridRod {
 public:
  GridRod() = default;
  GridRod(const Parameters& p, const Section& section, int points);

  int points() const { return points_; }
  int tcas() const { return tcas_; }
  /// Time in which a wave crosses one grid interval [s], less the retardation time, over which damping spreads a jump
  /// of the load along the rod. In shorter steps the strain at the tip, which the boundary condition W(L) = W_tip gives
  /// no inertia, follows a jump at once over a whole interval.
  double crossing_time() const;
  GridScratch scratch() const;

  /// Sets the state to the unloaded rod at rest.
  void set_unloaded(const GridState& state) const;
  /// Puts the state at rest at the equilibrium of the loads, starting from its present shape. On failure the state is
  /// unchanged.
  core::Status solve_equilibrium(const Loads& loads, const GridState& state, GridScratch& scratch) const;
  /// One step of length h [s], halved where Newton's method fails. Order 1 in time, 4 along the rod.
  StepOutcome step(const Inputs& u, double h, const GridState& state, GridScratch& scratch) const;
  void outputs(const Loads& loads, const ConstGridState& state, Outputs& y, unsigned parts = part::motion) const;
  /// Writes force and moment of the clamp on the rod, from the strain at the clamp; damping, which needs the rate of
  /// the strain, is left out.
  void clamp_reaction(const Loads& loads, const ConstGridState& state, Outputs& y) const;

 private:
  void body_energies(const Loads& loads, const ConstGridState& state, Outputs& y) const;
  struct StepEquations;
  pade::TcaVector displacements(const ConstGridState& state) const;
  void fit_pose(const GridState& state) const;
  void fit_stretch(const GridState& state) const;
  bool newton(StepEquations& step_equations, double withheld, GridScratch& scratch) const;
  bool newton_with_homotopy(StepEquations& step_equations, GridScratch& scratch) const;
  bool one_step(const Loads& loads, double h, const GridState& state, GridScratch& scratch) const;
  StepEquations step_equations(const Loads& loads, double h, const GridState& state, GridScratch& scratch) const;
  void accept(const StepEquations& step_equations, const Loads& loads, double h, const GridState& state,
              GridScratch& scratch) const;

  int points_ = 0, tcas_ = 0;
  double length_ = 0.0, spacing_ = 0.0;
  Section section_;
  std::vector<TcaLaw> laws_;
  Closure closure_ = Closure::inside;
  std::vector<double> weight_;                                    // of the integral over s [m]
  std::vector<std::array<pade::Vector3, kMaxTcas>> r_, r_slope_;  // routing and its derivative [m, 1]
  pade::TcaVector reference_length_;                              // m
  double period_ = 0.0;                                           // time scale of the first bending mode [s]
};

}  // namespace rod
