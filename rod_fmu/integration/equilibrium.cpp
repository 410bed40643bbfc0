// Equilibria (r = 0 at rest), and accelerations of a given motion (r is linear in a).
#include "integration/integrator.hpp"

namespace rod {

namespace {

constexpr double kEquilibriumTolerance = 1e-10;  // of the last Newton correction; the error behind it is its square
constexpr double kMaxSharpening = 1e-6;          // of a strain coefficient [1], by Newton's method after a descent
constexpr double kMaxPrediction = 0.3;           // change of a strain coefficient that a rate predicts for a step [1]
constexpr double kMaxBend = 0.5;                 // change of a rate within the last step, as a share of the rate: with
                                                 // more, a jump lay in it, and the rate alone predicts
constexpr double kMaxMiss = 0.1;                 // of such a prediction [1]; beyond, the start of the step is the guess
constexpr int kMaxFailures = 12;                 // of steps while falling

/// Dynamic relaxation from x towards an equilibrium: backward Euler from rest at every step, with lengths that grow
/// without bound. Inertia regularises the first steps where the static tangent is singular; the last are Newton steps
/// of statics.
bool relax_dynamically(const Rod& rod, const Loads& loads, Scratch& scratch, Vector& x) {
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
    if (scratch.newton.solve(rod, stage, loads, kEquilibriumTolerance, change).converged) {
      x += change;
      h *= 3.0;
    } else {
      if (++failures > kMaxFailures) return false;
      h *= 0.1;
    }
  }
  return true;
}

}  // namespace

core::Status solve_equilibrium(const Rod& rod, const Loads& loads, State& state, Scratch& scratch, double ahead) {
  scratch.stability.set_doubt(Stability::Doubt::none);
  Stage& stage = scratch.stage;
  const auto solve = [&] {
    stage.q.setZero(rod.unknowns());
    stage.weights = {.q = 1.0};
    stage.moving = false;
    return scratch.newton.solve_with_homotopy(rod, stage, loads, kEquilibriumTolerance, scratch.x).converged;
  };
  const auto solve_from_prediction = [&] {
    const double rate = state.v.lpNorm<Eigen::Infinity>();
    if (!(rate > 0.0 && ahead * rate <= kMaxPrediction)) return false;
    scratch.r = state.q + ahead * state.v;
    if (ahead * state.a.lpNorm<Eigen::Infinity>() <= kMaxBend * rate) scratch.r += (0.5 * ahead * ahead) * state.a;
    scratch.x = scratch.r;
    stage.q.setZero(rod.unknowns());
    stage.weights = {.q = 1.0};
    stage.moving = false;
    return scratch.newton.solve(rod, stage, loads, kEquilibriumTolerance, scratch.x).converged &&
           (scratch.x - scratch.r).lpNorm<Eigen::Infinity>() <= kMaxMiss;
  };
  const auto solve_from_start = [&] {
    scratch.x = state.q;
    return solve();
  };
  if (!solve_from_prediction() && !solve_from_start()) {
    scratch.x = state.q;
    if (!relax_dynamically(rod, loads, scratch, scratch.x) || !solve())
      return core::Status::discard("no equilibrium found (Newton's method, homotopy and dynamic relaxation failed)",
                                   "reduce the loads, or their change in one step");
  }
  const auto is_stable = [&] {
    return rod.is_admissible(scratch.x.data()) && scratch.stability.is_stable(rod, scratch.x, loads, scratch.newton);
  };
  if (!is_stable()) {
    const Vector unstable = scratch.x;
    scratch.x = state.q;
    core::Status status = scratch.stability.descend(rod, loads, kEquilibriumTolerance, scratch.x);
    if (!status.is_ok()) {
      if (!has_moment(loads) || !rod.is_admissible(unstable.data())) return status;
      scratch.stability.set_doubt(Stability::Doubt::unstable);
      scratch.x = unstable;
    }
    // Newton's method sharpens the solution; along a neutral direction it has nothing to hold on to.
    const Vector rest = scratch.x;
    if (!solve() || !rod.is_admissible(scratch.x.data()) ||
        (scratch.x - rest).lpNorm<Eigen::Infinity>() > kMaxSharpening)
      scratch.x = rest;
  }
  if (core::Status status = rod.check_strains(scratch.x.data()); !status.is_ok()) return status;
  state.q = scratch.x;
  state.v.setZero();
  state.a.setZero();
  state.time_ahead = 0.0;
  return {};
}

core::Status solve_acceleration(const Rod& rod, const Loads& loads, State& state, Scratch& scratch) {
  scratch.stage.q = state.q;
  scratch.stage.v = state.v;
  scratch.stage.a.setZero(rod.unknowns());
  scratch.stage.weights = {.a = 1.0};  // linear in a: one Newton step is exact
  scratch.stage.moving = true;
  scratch.x.setZero(rod.unknowns());
  const NewtonResult result = scratch.newton.solve_linear(rod, scratch.stage, loads, scratch.x);
  if (!result.converged)
    return core::Status::discard("no finite acceleration", "the strains or the loads may be too large");
  state.a = scratch.x;
  return {};
}

StepOutcome step_static(const Rod& rod, const Inputs& u, double h, State& state, Scratch& scratch) {
  const Loads loads = loads_at(u, h);
  scratch.v = state.v;
  core::Status status = solve_equilibrium(rod, loads, state, scratch, h);
  if (!status.is_ok()) return {0.0, std::move(status)};
  // The velocity of the moving equilibrium serves the rates of outputs, and with its own rate the prediction of the
  // next step; without inertia they have no other effect.
  scratch.r = state.q;
  scratch.newton.equilibrium_velocity(rod, scratch.r, loads, load_rates_at(u, h), scratch.x);
  state.v = scratch.x;
  if (!state.v.allFinite()) state.v.setZero();  // singular along a neutral direction
  state.a = (state.v - scratch.v) / h;
  return {h, {}};
}

}  // namespace rod
