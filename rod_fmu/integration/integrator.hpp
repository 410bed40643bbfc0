// Time integration of the rod: state, scratch, and one function per method, each in a file of its own with one
// signature.
#pragma once

#include <algorithm>

#include "core/status.hpp"
#include "integration/newton.hpp"
#include "integration/rosenbrock_tableaus.hpp"
#include "integration/stability.hpp"
#include "mechanics/rod.hpp"
#include "numerics/packed_lu.hpp"

namespace rod {

/// A point of the motion as views into plain doubles: q, v, a, then the dissipated energy.
struct MotionState {
  static std::size_t size(int unknowns) { return 3 * static_cast<std::size_t>(unknowns) + 1; }
  MotionState(double* memory, int unknowns)
      : q(memory, unknowns),
        v(memory + unknowns, unknowns),
        a(memory + 2 * unknowns, unknowns),
        dissipated(memory[3 * unknowns]) {}
  void assign(const MotionState& other) { q = other.q, v = other.v, a = other.a, dissipated = other.dissipated; }

  Eigen::Map<Vector> q, v, a;  // coefficients of the strains and their first and second rates [1, 1/s, 1/s2]
  double& dissipated;          // energy dissipated by the damping so far [J]
};

/// All that survives a step, as views into one array of plain doubles.
struct State : MotionState {
  static std::size_t size(int unknowns) { return 2 * MotionState::size(unknowns) + 2 + kLoadCount; }
  State(double* memory, int unknowns)
      : MotionState(memory, unknowns),
        ahead(memory + MotionState::size(unknowns), unknowns),
        next_step(memory[2 * MotionState::size(unknowns)]),
        time_ahead(memory[2 * MotionState::size(unknowns) + 1]),
        loads(memory + 2 * MotionState::size(unknowns) + 2) {}

  MotionState ahead;   // end of the last internal step where that is past the communication point; see dense_output.hpp
  double& next_step;   // length of the next internal step [s], 0: unknown
  double& time_ahead;  // time from the state to `ahead` [s], 0: nothing is ahead
  double* loads;       // kLoadCount constant loads of the last communication step, or infinity where they changed
};

/// Outcome of a step: the state belongs to `reached` [s after the start of the step]; a failure says why not to its
/// end.
struct StepOutcome {
  double reached = 0.0;
  core::Status status;
};

/// Largest number of internal steps in one call of length h [s]: a constant, and more per radian of the first mode than
/// any resolved motion needs, up to a bound on the work of one call.
inline double max_internal_steps(const Rod& rod, double h) {
  return std::min(2e4 + 5e3 * h * rod.first_frequency(), 1e6);
}

/// Point (q, v, a) or increment of one stage of a Rosenbrock method; e is the energy dissipated, integrated along.
struct Point {
  Vector q, v, a;
  double e = 0.0;

  void add(double factor, const Point& U) {
    q += factor * U.q;
    v += factor * U.v;
    a += factor * U.a;
    e += factor * U.e;
  }
};

/// Work arrays of the Rosenbrock methods.
struct StageMemory {
  std::array<Point, kMaxStages> U;
  Point y;
  Vector r, r_t, b1, b2, dr, power_slope;
  Matrix J;
  PackedLu lu;
};

/// Work arrays of all methods for one rod.
struct Scratch {
  Newton newton;
  Stage stage;
  Workspace work;
  Vector r, x, v;
  Stability stability;
  StageMemory stages;

  /// Makes room for what a step needs that comes later, such as one behind a jump of the inputs.
  void reserve(int unknowns) {
    newton.reserve(unknowns);
    for (Vector* each : {&stage.q, &stage.v, &stage.a, &r, &x, &v}) each->resize(unknowns);
  }

  /// Evaluations of the residual so far.
  long evaluations() const { return newton.work.evaluations + work.evaluations + stability.evaluations(); }
};

/// Puts the state at rest at a stable equilibrium of the loads, starting from its present shape: by Newton's method, by
/// a homotopy in the loads, by dynamic relaxation; from an unstable one along the overdamped motion from the present
/// shape. `ahead` [s] is the time for which the state's rates predict the solution. On failure the state is unchanged.
core::Status solve_equilibrium(const Rod& rod, const Loads& loads, State& state, Scratch& scratch, double ahead = 0.0);

/// Writes the acceleration that the loads give to (q, v). Fails where the mass matrix is singular or the state is not
/// finite.
core::Status solve_acceleration(const Rod& rod, const Loads& loads, State& state, Scratch& scratch);

/// Quasi-static: the equilibrium at the end of the step.
StepOutcome step_static(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch);

/// Backward Euler (Eq. 24), order 1: one step of length h, halved where Newton's method fails.
StepOutcome step_backward_euler(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch);
/// Implicit midpoint rule, order 2, without numerical damping: one step of length h, halved where Newton's method
/// fails.
StepOutcome step_midpoint(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch);
/// RODAS5P (Steinebach 2023), order 5(4), L-stable, as many steps as the tolerance needs.
StepOutcome step_rosenbrock(const Rod& rod, const Inputs& u, double h, double tolerance, State& state,
                            Scratch& scratch);
/// RODAS3 (Sandu 1997), order 3(2), L-stable, half the cost per step: for communication steps shorter than its own.
StepOutcome step_rosenbrock_3(const Rod& rod, const Inputs& u, double h, double tolerance, State& state,
                              Scratch& scratch);

}  // namespace rod
