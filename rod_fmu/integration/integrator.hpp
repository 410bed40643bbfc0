// Time integration of the rod. A state is all that survives a step; each method is one file with one signature.
#pragma once

#include <string>

#include "integration/newton.hpp"
#include "mechanics/rod.hpp"

namespace rod {

/// A point of the motion, as views into plain doubles: q, v, a, then the heat.
struct Moment {
  static std::size_t size(int unknowns) { return 3 * static_cast<std::size_t>(unknowns) + 1; }
  Moment(double* memory, int unknowns)
      : q(memory, unknowns),
        v(memory + unknowns, unknowns),
        a(memory + 2 * unknowns, unknowns),
        dissipated(memory[3 * unknowns]) {}
  void assign(const Moment& other) { q = other.q, v = other.v, a = other.a, dissipated = other.dissipated; }

  Eigen::Map<Vector> q, v, a;  // coefficients of the strains, their first and second rates [1, 1/s, 1/s2]
  double& dissipated;          // heat of the damping so far [J]
};

/// All that a rod remembers, in one array of plain doubles.
struct State : Moment {
  static std::size_t size(int unknowns) { return 2 * Moment::size(unknowns) + 2 + load_numbers; }
  State(double* memory, int unknowns)
      : Moment(memory, unknowns),
        ahead(memory + Moment::size(unknowns), unknowns),
        next_step(memory[2 * Moment::size(unknowns)]),
        left(memory[2 * Moment::size(unknowns) + 1]),
        loads(memory + 2 * Moment::size(unknowns) + 2) {}

  Moment ahead;       // where the last step ended, where that is past the communication point; see look_ahead.hpp
  double& next_step;  // length the method would try next [s], 0: unknown
  double& left;       // time from the state to `ahead` [s], 0: nothing is ahead
  double* loads;      // of the last communication step, where they stood still: load_numbers of them
};

/// How far a step came [s after its start], and why not further.
struct Advance {
  double reached = 0.0;
  std::string trouble;
};

/// Strain coefficients beyond this (radians, or multiples of the length) are no rod: a step that leads there is
/// refused.
inline constexpr double wildest_strain = 100.0;

/// Work arrays of all methods for one rod.
struct Scratch {
  Newton newton;
  Stage stage;
  Work work;
  Vector r, x;
};

/// Puts the state at rest at the equilibrium of the loads, from its present shape: by Newton's method, by a homotopy,
/// by letting the rod fall through ever longer implicit steps. False: not found, state as it was.
bool settle(const Rod& rod, const Loads& loads, State& state, Scratch& scratch);

/// The acceleration that the loads give to (q, v). False: the mass matrix is singular or the state is not finite.
bool accelerate(const Rod& rod, const Loads& loads, State& state, Scratch& scratch);

/// Quasi-static: the equilibrium at the end of the step.
Advance step_static(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch);

/// One step of the length asked for (halved where Newton fails): backward Euler, order 1, the paper's choice (Eq. 24).
Advance step_backward_euler(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch);
/// Implicit midpoint rule, order 2, keeps quadratic invariants: no numerical damping.
Advance step_midpoint(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch);
/// RODAS5P (Steinebach 2023), order 5(4), L-stable, as many steps as the tolerance needs.
Advance step_rosenbrock(const Rod& rod, const Inputs& u, double h, double tolerance, State& state, Scratch& scratch);
/// RODAS3, order 3(2), L-stable: half the price of a step, where communication is what keeps steps short.
Advance step_rosenbrock_3(const Rod& rod, const Inputs& u, double h, double tolerance, State& state, Scratch& scratch);

}  // namespace rod
