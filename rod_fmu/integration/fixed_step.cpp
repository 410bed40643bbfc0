// Implicit one-stage methods of fixed step: backward Euler (Eq. 24) and the midpoint rule. Both solve the stage
//   q = q0 + wq x, v = x/h, a = wa (x - h v0)   for x, the change of q over the step of length h.
#include "integration/halving.hpp"
#include "integration/integrator.hpp"

namespace rod {

namespace {

constexpr double kNewtonTolerance = 1e-11;  // of the last correction of the strains [1]

/// Initial guess of x: Taylor expansion for steps short against the rod's period, else 0.
void predict(const Rod& rod, double h, const State& state, Vector& x) {
  if (h * rod.first_frequency() < 1.0)
    x = h * state.v + (0.5 * h * h) * state.a;
  else
    x.setZero(rod.unknowns());
}

bool is_admissible_after(const Rod& rod, const State& state, Scratch& scratch) {
  scratch.r = state.q + scratch.x;
  return rod.is_admissible(scratch.r.data());
}

/// Solves the stage for x. Returns whether it converged to admissible strains.
bool solve(const Rod& rod, const Loads& loads, double h, double wq, double wa, const State& state, Scratch& scratch) {
  Stage& stage = scratch.stage;
  stage.q = state.q;
  stage.v.setZero(rod.unknowns());
  stage.a = (-wa * h) * state.v;
  stage.weights = {wq, 1.0 / h, wa};
  stage.moving = true;
  predict(rod, h, state, scratch.x);
  return scratch.newton.solve_with_homotopy(rod, stage, loads, kNewtonTolerance, scratch.x).converged &&
         is_admissible_after(rod, state, scratch);
}

bool backward_euler(const Rod& rod, const Loads& loads, double h, State& state, Scratch& scratch) {
  if (!solve(rod, loads, h, 1.0, 1.0 / (h * h), state, scratch)) return false;
  state.a = scratch.stage.a + scratch.stage.weights.a * scratch.x;
  state.v = scratch.x / h;
  state.q += scratch.x;
  state.dissipated += h * rod.damping_power(state.v);
  return true;
}

bool midpoint(const Rod& rod, const Loads& loads, double h, State& state, Scratch& scratch) {
  if (!solve(rod, loads, h, 0.5, 2.0 / (h * h), state, scratch)) return false;
  scratch.r = scratch.x / h;  // the mean rate
  state.dissipated += h * rod.damping_power(scratch.r);
  state.a = scratch.stage.a + scratch.stage.weights.a * scratch.x;
  state.v = 2.0 * scratch.r - state.v;
  state.q += scratch.x;
  return true;
}

}  // namespace

StepOutcome step_backward_euler(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch) {
  return advance_halving(h, [&](double from, double length) {
    return backward_euler(rod, loads_at(u, from + length), length, state, scratch);
  });
}

StepOutcome step_midpoint(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch) {
  return advance_halving(h, [&](double from, double length) {
    return midpoint(rod, loads_at(u, from + 0.5 * length), length, state, scratch);
  });
}

}  // namespace rod
