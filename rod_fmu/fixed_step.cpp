// Implicit one-stage methods whose step is the step asked for. Both are the stage
//   q = q0 + wq x, v = vb + wv x, a = ab + wa x, solved for x, the change of q over the step.
#include <cmath>

#include "integrator.hpp"

namespace rod {

namespace {

constexpr double newton_tolerance = 1e-11;
constexpr int most_halvings = 12;

/// Advances by h or fails and leaves the state as it was.
using OneStep = bool (*)(const Rod&, const Inputs&, double from, double h, State&, Scratch&);

/// Steps of length h/2^k with the smallest k that Newton's method allows, growing again behind a hard spot.
Advance advance(OneStep one_step, const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch) {
  double done = 0.0, step = h;
  while (done < h) {
    step = std::min(step, h - done);
    if (one_step(rod, u, done, step, state, scratch)) {
      done = step == h - done ? h : done + step;
      step *= 2.0;
    } else {
      step *= 0.5;
      if (step < std::ldexp(h, -most_halvings)) return {done, "Newton's method failed for every step length tried"};
    }
  }
  return {h, ""};
}

/// A first guess of x that is safe for steps long against the rod's period.
void predict(const Rod& rod, double h, const State& state, Vector& x) {
  if (h * rod.first_frequency() < 1.0)
    x = h * state.v + (0.5 * h * h) * state.a;
  else
    x.setZero(rod.unknowns());
}

bool backward_euler(const Rod& rod, const Inputs& u, double from, double h, State& state, Scratch& scratch) {
  Stage& stage = scratch.stage;
  stage.q = state.q;
  stage.v.setZero(rod.unknowns());
  stage.a = (-1.0 / h) * state.v;
  stage.weights = {1.0, 1.0 / h, 1.0 / (h * h)};
  stage.moving = true;
  predict(rod, h, state, scratch.x);
  if (!scratch.newton.solve(rod, stage, loads_at(u, from + h), newton_tolerance, scratch.x).converged) return false;

  state.a = stage.a + stage.weights.a * scratch.x;
  state.v = scratch.x / h;
  state.q += scratch.x;
  state.dissipated += h * rod.damping().dot(state.v.cwiseAbs2());
  return true;
}

bool midpoint(const Rod& rod, const Inputs& u, double from, double h, State& state, Scratch& scratch) {
  Stage& stage = scratch.stage;
  stage.q = state.q;
  stage.v.setZero(rod.unknowns());
  stage.a = (-2.0 / h) * state.v;
  stage.weights = {0.5, 1.0 / h, 2.0 / (h * h)};
  stage.moving = true;
  predict(rod, h, state, scratch.x);
  if (!scratch.newton.solve(rod, stage, loads_at(u, from + 0.5 * h), newton_tolerance, scratch.x).converged)
    return false;

  const auto mean = scratch.x / h;
  state.dissipated += h * rod.damping().dot(mean.cwiseAbs2());
  state.a = stage.a + stage.weights.a * scratch.x;
  state.v = 2.0 * mean - state.v;
  state.q += scratch.x;
  return true;
}

}  // namespace

Advance step_backward_euler(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch) {
  return advance(backward_euler, rod, u, h, state, scratch);
}

Advance step_midpoint(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch) {
  return advance(midpoint, rod, u, h, state, scratch);
}

}  // namespace rod
