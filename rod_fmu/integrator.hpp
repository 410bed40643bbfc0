// Time integration of the rod. A state is all that survives a step; each method is one file with one signature.
#pragma once

#include <string>

#include "newton.hpp"
#include "rod.hpp"

namespace rod {

/// All that a rod remembers, as views into one array of plain doubles: q, v, a, then two scalars.
struct State {
  static std::size_t size(int unknowns) { return 3 * static_cast<std::size_t>(unknowns) + 2; }
  State(double* memory, int unknowns)
      : q(memory, unknowns),
        v(memory + unknowns, unknowns),
        a(memory + 2 * unknowns, unknowns),
        next_step(memory[3 * unknowns]),
        dissipated(memory[3 * unknowns + 1]) {}

  Eigen::Map<Vector> q, v, a;  // coefficients of the strains, their first and second rates [1, 1/s, 1/s2]
  double& next_step;           // length the method would try next [s], 0: unknown
  double& dissipated;          // heat of the damping so far [J]
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

}  // namespace rod
