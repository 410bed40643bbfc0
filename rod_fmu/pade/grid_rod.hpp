// The paper's own scheme for the rod: pose, strain, velocity and eps' = |u| of every TCA on evenly spaced grid points,
// compact (Pade) derivatives of 4th order along the rod, backward Euler in time, Newton's method on the whole system
// with the displacements delta guessed and checked against int |u| ds - L_i (Eqs. 18-25, corrected).
//
// Which rows of the compact scheme: eta' is known from the strain rate at all points but the tip, where the load fixes
// the strain; W' from the acceleration at all points but the clamp, which does not move. So eta keeps its closure at
// the clamp and gives up the one at the tip, W the other way round, and the boundary conditions eta(0) = 0, W(L) =
// W_tip replace them. (The opposite choice determines the rates only through a recursion that grows like 3.7^n.)
//
// eps' is evolved in time, as in the paper: each step adds t . (u - u_before), which falls short of |u| by the square
// of the angle that u turned in the step, relative to the section: first order in the step, the order of the scheme.
// The pose is evolved by Eq. 22 within a step (exponential of the body velocity, unit quaternions instead of Euler
// rates); the step then ends with the pose that belongs to the strains, a difference of second order. Without that,
// pose and strain drift apart for good, and a rod that has come to rest shows its history.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "integration/integrator.hpp"
#include "mechanics/rod.hpp"
#include "pade/front_solver.hpp"

namespace rod {

/// All that a rod on a grid remembers, as views into one array of plain doubles [SI units]. Body frame but for the
/// pose.
class GridState {
 public:
  static constexpr int stride = 19 + pade::tcas;
  static std::size_t size(int points) { return static_cast<std::size_t>(points) * stride + 2 * pade::tcas + 7; }
  GridState(double* memory, int points) : memory_(memory), tail_(memory + points * stride), points_(points) {}

  Eigen::Map<Eigen::Vector4d> quaternion(int k) { return Eigen::Map<Eigen::Vector4d>(at(k)); }  // scalar part first
  Eigen::Map<pade::Three> position(int k) { return Eigen::Map<pade::Three>(at(k) + 4); }
  Eigen::Map<pade::Six> strain(int k) { return Eigen::Map<pade::Six>(at(k) + 7); }
  Eigen::Map<pade::Six> velocity(int k) { return Eigen::Map<pade::Six>(at(k) + 13); }
  Eigen::Map<pade::PerTcaVector> stretch(int k) { return Eigen::Map<pade::PerTcaVector>(at(k) + 19); }  // eps'
  Eigen::Map<pade::PerTcaVector> delta_rate() { return Eigen::Map<pade::PerTcaVector>(tail_); }         // last step's
  Eigen::Map<pade::PerTcaVector> tension() { return Eigen::Map<pade::PerTcaVector>(tail_ + pade::tcas); }  // at its end
  Eigen::Map<pade::Six> tip_load() { return Eigen::Map<pade::Six>(tail_ + 2 * pade::tcas); }  // moment, force then
  double& dissipated() { return tail_[2 * pade::tcas + 6]; }
  int points() const { return points_; }
  std::span<double> memory() { return {memory_, size(points_)}; }

 private:
  double* at(int k) { return memory_ + k * stride; }
  double *memory_, *tail_;
  int points_;
};

/// Work arrays for one rod on a grid. Never part of a state.
struct GridScratch {
  std::vector<pade::Before> before;
  std::vector<pade::Unknowns> z, change, firm;  // point of Newton's method, its correction, the last safe point
  std::vector<pade::Balance> balance;
  std::vector<pade::Row> rows;
  pade::FrontSolver solver;
  std::vector<double> backup;
  long evaluations = 0;  // of the residual at all points
};

/// Constant after construction.
class GridRod {
 public:
  GridRod() = default;
  GridRod(const Parameters& p, const Section& section, int points);

  int points() const { return points_; }
  GridScratch scratch() const;

  /// Unloaded and at rest.
  void straighten(GridState& state) const;
  /// Puts the state at rest at the equilibrium of the loads, from its present shape. False: not found, state as it was.
  bool settle(const Loads& loads, GridState& state, GridScratch& scratch) const;
  /// One step of the length asked for, halved where Newton's method fails. Order 1 in time, 4 along the rod.
  Advance step(const Inputs& u, double h, GridState& state, GridScratch& scratch) const;
  void outputs(const Loads& loads, GridState& state, Outputs& y) const;

 private:
  struct System;
  pade::PerTcaVector displacements(GridState& state) const;
  void fit_pose(GridState& state) const;
  void fit_stretch(GridState& state) const;
  bool newton(System& system, double withheld, GridScratch& scratch) const;
  bool newton_far(System& system, GridScratch& scratch) const;
  bool one_step(const Loads& loads, double h, GridState& state, GridScratch& scratch) const;
  System system(const Loads& loads, double h, GridState& state, GridScratch& scratch) const;
  void accept(const System& system, const Loads& loads, double h, GridState& state, GridScratch& scratch) const;

  int points_ = 0;
  double length_ = 0.0, spacing_ = 0.0;
  Section section_;
  TcaLaw law_;
  Closure closure_ = Closure::inside;
  std::vector<double> weight_;                                   // of the integral over s [m]
  std::vector<std::array<pade::Three, tca_count>> r_, r_slope_;  // routing and its derivative [m, 1]
  pade::PerTcaVector reference_length_;                          // m
  double period_ = 0.0;                                          // s, of the first bending mode, roughly
};

}  // namespace rod
