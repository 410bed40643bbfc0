// Creep of measured TCAs: the law with its Kelvin element against differences, a hanging TCA in a soft body against its
// closed form, energy, and what does not change.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "integration/creep.hpp"
#include "rod_support.hpp"

namespace {

using rod::Law;
using rod::Parameters;
using rod::Tca;
using rod::TcaLaw;

TEST(RodCreep, TheLawIsExactInDisplacementAndTemperature) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int draw = 0; draw < 50; ++draw) {
    Parameters p(1);
    Tca& tca = p.tca[0];
    tca.law = Law::measured, tca.chirality = draw % 2 ? 1 : -1;
    tca.stiffness = 5.0 + 20.0 * uniform(random), tca.stiffening = 300.0 * uniform(random);
    tca.stroke_curvature = 1e-6 * uniform(random);
    tca.creep_compliance = 0.1 * uniform(random) + 1e-3, tca.creep_time = 3.0, tca.creep_activation = 2e3;
    tca.stop = 0.0, tca.stop_width = 5e-3, tca.stop_stiffness = 40.0;
    TcaLaw law(p, 0);
    const double span = 10.0 * uniform(random), base = 2e-3 * uniform(random);
    law.set_creep(base, span);
    const double delta = 0.02 * uniform(random), T = 300.0 + 80.0 * uniform(random);
    const auto slope = [&](auto at, double h) {
      return (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
    };
    const rod::Tension N = law.tension(delta, T);
    EXPECT_NEAR(N.per_delta, slope([&](double h) { return law.tension(delta + h, T).value; }, 1e-5),
                1e-8 * std::abs(N.per_delta));
    EXPECT_NEAR(N.per_T, slope([&](double h) { return law.tension(delta, T + h).value; }, 1e-2),
                1e-8 * std::abs(N.per_T) + 1e-12);
    const TcaLaw::Creep creep = law.creep(delta, T);
    EXPECT_NEAR(creep.z, base + span * creep.rate, 1e-15);
    EXPECT_GE(creep.power, 0.0);
    law.set_creep(creep.z, 0.0);  // the tension of the moment is the potential's slope
    EXPECT_NEAR(law.tension(delta, T).value, slope([&](double h) { return law.energy(delta + h, T); }, 1e-5), 1e-9);
    EXPECT_NEAR(law.creep(delta, T).rate, creep.rate, 1e-12);
  }
}

/// One TCA along the axis of a body that only stretches, pulled by a force at the tip: with K = EA/L
///   K delta + k (delta - z) = F,   tau dz/dt = J k (delta - z) - z,   hence z -> z_end exponentially.
struct Hanging {
  explicit Hanging(double T_rise = 0.0, double stiffening = 0.0) : parameters(1) {
    Tca& tca = parameters.tca[0];
    tca.law = Law::measured, tca.offset = tca.offset_end = 0.0, tca.stroke = 0.0;
    tca.stiffness = k, tca.stiffening = stiffening;
    tca.creep_compliance = J, tca.creep_time = tau_0, tca.creep_activation = Q;
    parameters.set(&rod::Segment::order, 0);
    parameters.set(&rod::Segment::strains, rod::Strains::extensible);
    parameters.dynamic = false;
    T = parameters.T_0 + T_rise;
    body = rod::make_rod(parameters);
    memory.assign(rod::State::size(body->unknowns()), 0.0);
    inputs.tcas = 1;
    inputs.T[0][0] = T;
    K = parameters.segment[0].E * std::numbers::pi * 25e-6 / 0.04;
    tau = tau_0 * std::exp(Q * (1.0 / T - 1.0 / parameters.T_0));
  }

  rod::State state() { return rod::State(memory.data(), body->unknowns()); }
  void load(double force) {
    inputs.tip_force[2][0] = force;
    rod::set_creep(*body, z.data());
    rod::State now = state();
    ASSERT_TRUE(rod::solve_equilibrium(*body, rod::loads_at(inputs, 0.0), now, scratch).is_ok());
  }
  void advance(double h, double tolerance = 1e-8) {
    rod::State now = state();
    const rod::StepOutcome outcome = integrator.step(*body, inputs, h, tolerance, now, z.data(), scratch);
    ASSERT_TRUE(outcome.status.is_ok()) << outcome.status.failure().what;
    ASSERT_EQ(outcome.reached, h);
  }
  rod::Outputs outputs() {
    rod::Outputs y;
    rod::State now = state();
    const rod::Loads loads = rod::loads_at(inputs, 0.0);
    rod::set_creep(*body, z.data());
    body->kinematics(now.q.data(), now.v.data(), loads, scratch.newton.work);
    body->outputs(now.q.data(), now.v.data(), loads, scratch.newton.work, y);
    y.energy_dissipated = now.dissipated;
    return y;
  }
  double rate() const { return (1.0 + J * k * K / (K + k)) / tau; }
  double end(double force) const { return J * k * force / (K + k) / (tau * rate()); }

  static constexpr double k = 20.0, J = 0.08, tau_0 = 4.0, Q = 3000.0;
  Parameters parameters;
  rod::Inputs inputs;
  double K = 0.0, T = 0.0, tau = 0.0;
  std::unique_ptr<rod::Rod> body;
  std::vector<double> memory;
  rod::PerTca<double> z{};
  rod::Scratch scratch;
  rod::CreepIntegrator integrator;
};

TEST(RodCreep, ConstantLoadCreepsExponentially) {
  for (const double rise : {0.0, 40.0}) {  // hotter TCAs creep faster
    Hanging hanging(rise);
    hanging.load(0.5);
    for (int step = 1; step <= 12; ++step) {
      hanging.advance(0.7);
      const double z = hanging.end(0.5) * -std::expm1(-hanging.rate() * 0.7 * step);
      EXPECT_NEAR(hanging.z[0], z, 2e-7 * hanging.end(0.5));
      EXPECT_NEAR(hanging.outputs().delta[0], (0.5 + hanging.k * z) / (hanging.K + hanging.k), 1e-9);
      const double z_rate = hanging.rate() * (hanging.end(0.5) - z);
      EXPECT_NEAR(hanging.outputs().delta_rate[0], hanging.k * z_rate / (hanging.K + hanging.k), 1e-8);
    }
  }
}

TEST(RodCreep, ItRecoversBehindAStepInLoad) {
  Hanging hanging;
  hanging.load(0.5);
  hanging.advance(5.0);
  const double crept = hanging.end(0.5) * -std::expm1(-5.0 * hanging.rate());
  hanging.load(0.0);  // at once: the spring, not the creep
  EXPECT_NEAR(hanging.outputs().delta[0], hanging.k * crept / (hanging.K + hanging.k), 1e-9);
  hanging.advance(3.0);
  EXPECT_NEAR(hanging.z[0], crept * std::exp(-3.0 * hanging.rate()), 2e-7 * crept);
}

TEST(RodCreep, ErrorsFollowTheTolerance) {
  double before = 1.0;
  for (const double tolerance : {1e-3, 1e-5, 1e-7}) {
    Hanging hanging;
    hanging.load(0.5);
    hanging.advance(8.0, tolerance);
    const double error = std::abs(hanging.z[0] / (hanging.end(0.5) * -std::expm1(-8.0 * hanging.rate())) - 1.0);
    EXPECT_LT(error, 20.0 * tolerance);
    EXPECT_LT(error, 0.2 * before);
    before = error;
  }
}

TEST(RodCreep, OneStepIsOfOrderThree) {
  double before = 0.0;
  for (const double h : {0.4, 0.2, 0.1}) {
    Hanging hanging;
    hanging.load(0.5);
    for (int step = 0; step * h < 1.6 - 1e-9; ++step) {
      rod::State now = hanging.state();
      now.next_step = h;
      hanging.advance(h, 1.0);  // every internal step has this length
    }
    const double error = std::abs(hanging.z[0] / (hanging.end(0.5) * -std::expm1(-1.6 * hanging.rate())) - 1.0);
    if (before > 0.0) {
      EXPECT_NEAR(std::log2(before / error), 3.0, 0.25);
    }
    before = error;
  }
}

TEST(RodCreep, WorkIsStoredOrDissipated) {
  Hanging hanging(0.0, 400.0);
  hanging.load(0.4);
  const rod::Outputs start = hanging.outputs();
  double dissipated = 0.0;
  for (int step = 0; step < 8; ++step) {
    hanging.advance(1.0, 1e-9);
    const rod::Outputs now = hanging.outputs();
    const double work = 0.4 * (now.tip_p[2] - start.tip_p[2]);
    const double stored = now.energy_elastic + now.energy_tca - start.energy_elastic - start.energy_tca;
    EXPECT_GT(now.energy_dissipated, dissipated);
    dissipated = now.energy_dissipated;
    EXPECT_NEAR(work, stored + dissipated, 1e-6 * work);
  }
}

TEST(RodCreep, InBendingItSolvesTheSameEquations) {
  // Three TCAs under heat and a side load: the last stage is an equilibrium, and dz/dt = (J N - z)/tau there.
  Parameters p;
  p.dynamic = false;
  p.set(&Tca::law, Law::measured), p.set(&Tca::stiffness, 30.0), p.set(&Tca::stiffening, 200.0);
  p.set(&Tca::creep_compliance, 0.05), p.set(&Tca::creep_time, 2.0);
  p.tca[1].creep_compliance = 0.0;  // one that does not creep
  const auto at = [&](double h, int steps) {
    const std::unique_ptr<rod::Rod> body = rod::make_rod(p);
    std::vector<double> memory(rod::State::size(body->unknowns()), 0.0);
    rod::State state(memory.data(), body->unknowns());
    rod::Inputs u;
    u.T[0][0] = 330.0, u.T[1][0] = 310.0, u.tip_force[1][0] = 0.01;
    rod::PerTca<double> z{};
    rod::Scratch scratch;
    rod::CreepIntegrator integrator;
    for (int k = 0; k < steps; ++k)
      EXPECT_TRUE(integrator.step(*body, u, h, 1e-7, state, z.data(), scratch).status.is_ok());
    return std::pair(z, rod::Vector(state.v));
  };
  const auto [z, v] = at(0.5, 4);
  EXPECT_EQ(z[1], 0.0);
  EXPECT_GT(std::abs(z[0]), 1e-5);
  const auto [once, same] = at(2.0, 1);  // communication points change nothing
  EXPECT_NEAR(z[0], once[0], 1e-6 * std::abs(z[0]));
  EXPECT_NEAR(z[2], once[2], 1e-6 * std::abs(z[0]));
  EXPECT_NEAR((v - same).norm(), 0.0, 1e-4 * v.norm());
}

}  // namespace
