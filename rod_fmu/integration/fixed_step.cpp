// Implicit one-stage methods whose step is the step asked for. Both are the stage
//   q = q0 + wq x, v = vb + wv x, a = ab + wa x, solved for x, the change of q over the step.
#include "integration/halving.hpp"
#include "integration/integrator.hpp"

namespace rod {

namespace {

constexpr double newton_tolerance = 1e-11;

/// A first guess of x that is safe for steps long against the rod's period.
void predict(const Rod& rod, double h, const State& state, Vector& x) {
  if (h * rod.first_frequency() < 1.0)
    x = h * state.v + (0.5 * h * h) * state.a;
  else
    x.setZero(rod.unknowns());
}

/// Solves for x, the change of q over a step of length h, with q + wq x, x/h and wa (x - h v) in the balance. True:
/// found.
bool solve(const Rod& rod, const Loads& loads, double h, double wq, double wa, const State& state, Scratch& scratch) {
  Stage& stage = scratch.stage;
  stage.q = state.q;
  stage.v.setZero(rod.unknowns());
  stage.a = (-wa * h) * state.v;
  stage.weights = {wq, 1.0 / h, wa};
  stage.moving = true;
  predict(rod, h, state, scratch.x);
  return scratch.newton.solve_far(rod, stage, loads, newton_tolerance, scratch.x).converged &&
         (state.q + scratch.x).lpNorm<Eigen::Infinity>() < wildest_strain;
}

bool backward_euler(const Rod& rod, const Loads& loads, double h, State& state, Scratch& scratch) {
  if (!solve(rod, loads, h, 1.0, 1.0 / (h * h), state, scratch)) return false;
  state.a = scratch.stage.a + scratch.stage.weights.a * scratch.x;
  state.v = scratch.x / h;
  state.q += scratch.x;
  state.dissipated += h * rod.damping().dot(state.v.cwiseAbs2());
  return true;
}

bool midpoint(const Rod& rod, const Loads& loads, double h, State& state, Scratch& scratch) {
  if (!solve(rod, loads, h, 0.5, 2.0 / (h * h), state, scratch)) return false;
  const auto mean = scratch.x / h;
  state.dissipated += h * rod.damping().dot(mean.cwiseAbs2());
  state.a = scratch.stage.a + scratch.stage.weights.a * scratch.x;
  state.v = 2.0 * mean - state.v;
  state.q += scratch.x;
  return true;
}

}  // namespace

Advance step_backward_euler(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch) {
  return advance_halving(h, [&](double from, double length) {
    return backward_euler(rod, loads_at(u, from + length), length, state, scratch);
  });
}

Advance step_midpoint(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch) {
  return advance_halving(h, [&](double from, double length) {
    return midpoint(rod, loads_at(u, from + 0.5 * length), length, state, scratch);
  });
}

}  // namespace rod
