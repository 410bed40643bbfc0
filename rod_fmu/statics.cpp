// Equilibria, and accelerations of a given motion.
#include "integrator.hpp"

namespace rod {

namespace {

constexpr double equilibrium_tolerance = 1e-10;  // of the last Newton correction; the error behind it is its square

}  // namespace

bool settle(const Rod& rod, const Loads& loads, State& state, Scratch& scratch) {
  const int n = rod.unknowns();
  scratch.stage.q.setZero(n);
  scratch.stage.weights = {.q = 1.0};
  scratch.stage.moving = false;
  scratch.x = state.q;
  const NewtonResult result = scratch.newton.solve_far(rod, scratch.stage, loads, equilibrium_tolerance, scratch.x);
  if (!result.converged) return false;
  state.q = scratch.x;
  state.v.setZero();
  state.a.setZero();
  return true;
}

bool accelerate(const Rod& rod, const Loads& loads, State& state, Scratch& scratch) {
  scratch.stage.q = state.q;
  scratch.stage.v = state.v;
  scratch.stage.a.setZero(rod.unknowns());
  scratch.stage.weights = {.a = 1.0};  // linear in a: one Newton step is exact
  scratch.stage.moving = true;
  scratch.x.setZero(rod.unknowns());
  const NewtonResult result = scratch.newton.solve_linear(rod, scratch.stage, loads, scratch.x);
  if (!result.converged) return false;
  state.a = scratch.x;
  return true;
}

Advance step_static(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch) {
  if (settle(rod, loads_at(u, h), state, scratch)) return {h, ""};
  return {0.0, "no equilibrium found for the inputs at the end of the step (Newton's method and homotopy failed)"};
}

}  // namespace rod
