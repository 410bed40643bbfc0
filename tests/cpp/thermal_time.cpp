// Exactness in time: phi functions, polynomials, steps of any length, inputs up to cubic, restart.
#include <gtest/gtest.h>

#include <cmath>

#include "levels/phi.hpp"
#include "levels/polynomials.hpp"
#include "mesh/spectral.hpp"
#include "thermal_scene.hpp"

namespace thermal {
namespace {

/// phi_j(-x) = integral over [0, 1] of e^(-x (1 - s)) s^(j-1)/(j-1)!, by its series in long double, x below 20.
double phi_by_series(int j, double x) {
  long double sum = 0, term = 1;
  for (int k = 1; k <= j; ++k) term /= k;
  for (int m = 0; m < 200; ++m) {
    sum += term * j / (j + m);
    term *= static_cast<long double>(x) / (m + 1);
  }
  return static_cast<double>(sum * std::exp(-static_cast<long double>(x)));
}

TEST(Phi, AgreesWithItsSeriesForSmallAndMiddlingArguments) {
  for (double x : {0.0, 1e-12, 1e-6, 1e-3, 0.1, 0.5, 1.0, 1.9999, 2.0, 2.5, 4.0, 7.0, 12.0, 19.0}) {
    const auto f = phi<7>(x);
    EXPECT_DOUBLE_EQ(f[0], std::exp(-x));
    for (int j = 1; j <= 7; ++j) EXPECT_NEAR(f[j] / phi_by_series(j, x), 1.0, 1e-12) << "j = " << j << ", x = " << x;
  }
}

TEST(Phi, TendsToItsAsymptoteForLargeArguments) {
  for (double x : {1e4, 1e8, 1e150}) {
    const auto f = phi<7>(x);
    double factorial = 1.0;
    for (int j = 1; j <= 7; ++j) {
      EXPECT_NEAR(f[j] * x * factorial, 1.0, 10.0 / x) << "j = " << j << ", x = " << x;
      factorial *= j;
    }
  }
}

TEST(Polynomials, SquareAndVariation) {
  const Cubic v{1.0, -2.0, 3.0, 4.0};
  const Sextic v2 = square(v);
  for (double s : {0.0, 0.3, 1.7, 5.0}) EXPECT_NEAR(value(v2, s), std::pow(value(v, s), 2), 1e-12 * value(v2, s));
  // Never below the true variation; exact for monotone polynomials.
  EXPECT_DOUBLE_EQ(variation(Cubic{2.0, 3.0, 0.0, 0.0}, 2.0), 6.0);
  double travelled = 0.0;
  for (int i = 0; i < 10000; ++i) {
    travelled += std::abs(value(v2, 3.0 * (i + 1) / 10000) - value(v2, 3.0 * i / 10000));
  }
  EXPECT_GE(variation(v2, 3.0), travelled);
  EXPECT_LE(variation(v2, 3.0), 2.0 * travelled);
}

class ExactLevels : public testing::TestWithParam<Level> {
 protected:
  Trajectory start() const {
    Parameters p;
    p.level = GetParam();
    return run_of(p);
  }
};

TEST_P(ExactLevels, ConstantVoltagesInStepsOfAnyLength) {
  const Drive drive = step_scene();
  Trajectory once = start();
  once.advance(drive, 30.0);
  const Observation expected = once.observe(drive);
  for (int steps : {3, 30, 300, 3000}) {
    Trajectory run = start();
    for (int i = 0; i < steps; ++i) run.advance(drive, 30.0 / steps);
    const Observation seen = run.observe(drive);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(seen.rise[i], expected.rise[i], 1e-10) << steps << " steps";
  }
}

TEST_P(ExactLevels, CubicVoltagesAndSurroundingsInStepsOfAnyLength) {
  Drive whole;
  for (std::size_t i = 0; i < 3; ++i) whole.V[i] = {1.0 + 0.5 * static_cast<double>(i), 0.2, -0.05, 0.01};
  whole.ambient_rise = {5.0, -1.0, 0.2, -0.03};
  const auto at = [](const Cubic& c, double s) { return core::shifted(c, s); };
  Trajectory once = start(), run = start();
  once.advance(whole, 10.0);
  for (int n = 0; n < 40; ++n) {
    Drive part;
    for (std::size_t i = 0; i < 3; ++i) part.V[i] = at(whole.V[i], 0.25 * n);
    part.ambient_rise = at(whole.ambient_rise, 0.25 * n);
    run.advance(part, 0.25);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(run.observe({}).rise[i], once.observe({}).rise[i], 1e-10);
    EXPECT_GT(once.observe({}).rise[i], 1.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Thermal, ExactLevels, testing::Values(Level::lumped, Level::reduced));

class EveryLevel : public testing::TestWithParam<std::tuple<Level, double>> {
 protected:
  Parameters parameters() const {
    Parameters p;
    p.level = std::get<0>(GetParam());
    p.tca.alpha_T = filled(std::get<1>(GetParam()));
    p.tca.beta = filled(25.0 * std::get<1>(GetParam()));
    return p;
  }
};

TEST_P(EveryLevel, RestoredStateStepsBitwiseTheSame) {
  Trajectory run = run_of(parameters());
  Drive drive = step_scene();
  drive.V[0] = {2.0, 0.3, 0.1, 0.0};
  for (double h : {0.1, 0.1, 0.37}) run.advance(drive, h);
  const std::vector<double> saved = run.state;
  run.advance(drive, 0.2);
  const std::vector<double> expected = run.state;
  run.advance(step_scene(), 3.0);  // elsewhere, to leave traces
  run.state = saved;
  run.advance(drive, 0.2);
  EXPECT_EQ(run.state, expected);
  Trajectory another = run_of(parameters());
  another.state = saved;
  another.advance(drive, 0.2);
  EXPECT_EQ(another.state, expected);
}

/// Stored heat against the integral of power less loss, by Gauss-Lobatto quadrature on short steps.
TEST_P(EveryLevel, HeatIsBalanced) {
  const Parameters p = parameters();
  Trajectory run = run_of(p);
  Drive drive = step_scene();
  drive.ambient_rise[0] = -3.0;
  // Start-up at a jump is not polynomial: steps grow with time.
  double net = 0.0, work = 0.0, t = 0.0;
  const LobattoRule rule = lobatto_rule(8);
  for (double h = 1e-6; t < 20.0; h = std::min(0.5, 1.3 * h)) {
    double reached = 0.0;
    for (Eigen::Index n = 0; n < rule.nodes.size(); ++n) {
      const double at = 0.5 * h * (1.0 + rule.nodes[n]);
      if (at > reached) run.advance(drive, at - reached);
      reached = at;
      const Observation seen = run.observe(drive);
      double power = 0.0;
      for (std::size_t i = 0; i < p.tca.count; ++i) power += seen.power[i];
      net += 0.5 * h * rule.weights[n] * (power - seen.loss);
      work += 0.5 * h * rule.weights[n] * power;
    }
    t += h;
  }
  const double allowed = p.level == Level::full ? p.tolerance : 1e-9;
  EXPECT_NEAR(run.observe(drive).stored / net, 1.0, allowed) << "work " << work;
  EXPECT_GT(work, 10.0);
}

INSTANTIATE_TEST_SUITE_P(Thermal, EveryLevel,
                         testing::Combine(testing::Values(Level::lumped, Level::reduced, Level::full),
                                          testing::Values(0.0, 0.004)));

}  // namespace
}  // namespace thermal
