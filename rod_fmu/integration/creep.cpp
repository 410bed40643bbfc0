#include "integration/creep.hpp"

#include <algorithm>
#include <cmath>

namespace rod {

namespace {

// Alexander's method: gamma is the root of x^3 - 3 x^2 + 3/2 x - 1/6 in (1/6, 1/2).
constexpr double kGamma = 0.43586652150845899942;
constexpr double kMiddle = 0.5 * (1.0 + kGamma);  // time of the second stage
constexpr double kB1 = -1.5 * kGamma * kGamma + 4.0 * kGamma - 0.25, kB2 = 1.5 * kGamma * kGamma - 5.0 * kGamma + 1.25;
constexpr std::array<double, 3> kTimes{kGamma, kMiddle, 1.0};
constexpr std::array<std::array<double, 3>, 3> kTableau{{{kGamma}, {kMiddle - kGamma, kGamma}, {kB1, kB2, kGamma}}};
// Order 2 on the first two stages: weights whose sum is 1 and whose mean time is 1/2.
constexpr double kLow2 = (0.5 - kGamma) / (kMiddle - kGamma), kLow1 = 1.0 - kLow2;
constexpr std::array<double, 3> kDifference{kB1 - kLow1, kB2 - kLow2, kGamma};

constexpr double kSafety = 0.9, kLeastChange = 0.2, kMostChange = 5.0;  // of the step's length
constexpr double kFloor = 1e-12;                                        // m, absolute error that is always allowed
constexpr double kShortest = 1e-10;                                     // of h: steps below that give up

}  // namespace

core::Status CreepIntegrator::attempt(Rod& rod, const Inputs& u, double start, double length, double tolerance,
                                      State& state, const double* z, Scratch& scratch) {
  dissipated_ = 0.0;
  for (std::size_t k = 0; k < kStages; ++k) {
    for (std::size_t i = 0; i < rod.tcas(); ++i) {
      double base = z[i];
      for (std::size_t m = 0; m < k; ++m) base += length * kTableau[k][m] * rate_[m][i];
      rod.set_creep(i, base, length * kGamma);
    }
    const Loads loads = loads_at(u, start + kTimes[k] * length);
    if (core::Status status = solve_equilibrium(rod, loads, state, scratch); !status.is_ok()) return status;
    rod.kinematics(state.q.data(), state.v.data(), loads, scratch.work, stage::tcas);
    for (std::size_t i = 0; i < rod.tcas(); ++i) {
      if (!rod.law(i).creeps()) continue;
      const TcaLaw::Creep creep = rod.law(i).creep(scratch.work.delta[i], loads.T[i]);
      rate_[k][i] = creep.rate;
      end_[i] = creep.z;
      dissipated_ += length * kTableau[2][k] * creep.power;
    }
  }
  error_ = 0.0;
  for (std::size_t i = 0; i < rod.tcas(); ++i) {
    if (!rod.law(i).creeps()) continue;
    double difference = 0.0;
    for (std::size_t k = 0; k < kStages; ++k) difference += length * kDifference[k] * rate_[k][i];
    const double scale = std::abs(end_[i]) + rod.law(i).creep_compliance() * std::abs(scratch.work.tension[i].value);
    error_ = std::max(error_, std::abs(difference) / (tolerance * scale + kFloor));
  }
  if (!std::isfinite(error_))
    return core::Status::discard("the creep of a TCA is not finite", "reduce the loads or the heat");
  return {};
}

StepOutcome CreepIntegrator::step(Rod& rod, const Inputs& u, double h, double tolerance, State& state, double* z,
                                  Scratch& scratch) {
  double reached = 0.0, next = state.next_step > 0.0 ? state.next_step : h;
  while (reached < h) {
    const double rest = h - reached;
    const bool is_last = next >= rest * (1.0 - 1e-9);
    const double length = is_last ? rest : std::min(next, 0.5 * rest);
    before_ = state.q;
    core::Status status = attempt(rod, u, reached, length, tolerance, state, z, scratch);
    const double factor = status.is_ok() ? kSafety * std::cbrt(1.0 / std::max(error_, 1e-9)) : kLeastChange;
    const double proposal = length * std::clamp(factor, kLeastChange, kMostChange);
    if (status.is_ok() && error_ <= 1.0) {
      std::copy_n(end_.begin(), rod.tcas(), z);
      state.dissipated += dissipated_;
      reached = is_last ? h : reached + length;
      next = is_last && proposal >= length ? std::max(next, proposal) : proposal;
      state.next_step = next;
      continue;
    }
    state.q = before_;
    next = std::min(proposal, 0.5 * length);
    if (next < kShortest * h) {
      set_creep(rod, z);
      state.next_step = 0.0;
      if (status.is_ok())
        status = core::Status::discard(
            "the creep of a TCA is too fast to be followed",
            "give it more time (tca.creep_time, a smaller tca.creep_activation), take shorter steps, or leave it out "
            "(tca.creep_compliance = 0)");
      return {reached, std::move(status)};
    }
  }
  // The velocity of the moving equilibrium, for the rates of outputs.
  set_creep(rod, z);
  const Loads loads = loads_at(u, h);
  if (core::Status status = solve_equilibrium(rod, loads, state, scratch); !status.is_ok())
    return {h, std::move(status)};
  scratch.r = state.q;
  scratch.newton.equilibrium_velocity(rod, scratch.r, loads, load_rates_at(u, h), scratch.x, [&](Vector& dr) {
    const Workspace& work = scratch.newton.work;
    for (std::size_t i = 0; i < rod.tcas(); ++i) {
      if (!rod.law(i).creeps()) continue;
      const TcaLaw::Creep creep = rod.law(i).creep(work.delta[i], loads.T[i]);
      dr += creep.tension_per_z * creep.rate * work.b[i];
    }
  });
  state.v = scratch.x;
  if (!state.v.allFinite()) state.v.setZero();  // singular along a neutral direction
  return {h, {}};
}

}  // namespace rod
