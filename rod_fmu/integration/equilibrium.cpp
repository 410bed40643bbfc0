// Equilibria, and accelerations of a given motion.
#include "integration/integrator.hpp"

namespace rod {

namespace {

constexpr double equilibrium_tolerance = 1e-10;  // of the last Newton correction; the error behind it is its square
constexpr int most_failures = 12;                // of steps while falling

/// From x, to the neighbourhood of an equilibrium: backward Euler from rest at every step, with lengths that grow
/// without bound. The inertia of the first carries the rod over hard ground, the last are Newton steps of statics.
bool fall(const Rod& rod, const Loads& loads, Scratch& scratch, Vector& x) {
  Stage& stage = scratch.stage;
  const int n = rod.unknowns();
  stage.v.setZero(n);
  stage.a.setZero(n);
  stage.moving = true;
  Vector change;
  const double period = 1.0 / rod.first_frequency();
  int failures = 0;
  for (double h = 0.1 * period; h < 1e6 * period;) {
    stage.q = x;
    stage.weights = {1.0, 1.0 / h, 1.0 / (h * h)};
    change.setZero(n);
    if (scratch.newton.solve(rod, stage, loads, equilibrium_tolerance, change).converged) {
      x += change;
      h *= 3.0;
    } else {
      if (++failures > most_failures) return false;
      h *= 0.1;
    }
  }
  return true;
}

}  // namespace

bool settle(const Rod& rod, const Loads& loads, State& state, Scratch& scratch) {
  Stage& stage = scratch.stage;
  const auto solve = [&] {
    stage.q.setZero(rod.unknowns());
    stage.weights = {.q = 1.0};
    stage.moving = false;
    return scratch.newton.solve_far(rod, stage, loads, equilibrium_tolerance, scratch.x).converged;
  };
  scratch.x = state.q;
  if (!solve()) {
    scratch.x = state.q;
    if (!fall(rod, loads, scratch, scratch.x) || !solve()) return false;
  }
  if (!(scratch.x.lpNorm<Eigen::Infinity>() < wildest_strain)) return false;
  state.q = scratch.x;
  state.v.setZero();
  state.a.setZero();
  state.left = 0.0;
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
  const Loads loads = loads_at(u, h);
  if (settle(rod, loads, state, scratch)) {
    // The velocity with which the equilibrium moves on: for outputs' rates, without inertia it acts on nothing.
    scratch.newton.drift(rod, loads, load_rates_at(u, h), scratch.x);
    state.v = scratch.x;
    return {h, ""};
  }
  return {0.0, "no equilibrium found for the inputs at the end of the step (Newton's method and homotopy failed)"};
}

}  // namespace rod
