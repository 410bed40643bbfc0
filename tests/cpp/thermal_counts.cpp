// The heat model for 1 to 12 TCAs: uneven, unsorted azimuths, different resistances.
#include <gtest/gtest.h>

#include <numbers>
#include <tuple>

#include "thermal_scene.hpp"

namespace thermal {
namespace {

/// TCAs that crowd on one side as far as they fit, named in no order, each with its own resistance.
Parameters uneven(std::size_t count) {
  Parameters p(count);
  p.tca.offset = filled(3e-3);
  const double apart = std::min(0.7, 5.5 / static_cast<double>(count));
  p.tca.outer_radius = filled(std::min(0.85e-3, 0.9 * 3e-3 * std::sin(apart / 2.0)));
  for (std::size_t i = 0; i < count; ++i) {
    p.tca.azimuth[i] = 0.4 + apart * static_cast<double>((5 * i + 2) % count);  // a permutation: 5 divides no count
    p.tca.R[i] = 4.0 + static_cast<double>(i);
  }
  return p;
}

class Count : public testing::TestWithParam<std::tuple<std::size_t, bool>> {
 protected:
  Parameters parameters() const { return std::get<1>(GetParam()) ? uneven(count) : Parameters(count); }
  const std::size_t count = std::get<0>(GetParam());
};

TEST_P(Count, AreasAreThoseOfCircles) {
  const Parameters p = parameters();
  const HeatMatrices m = must(heat_matrices(p, 6));
  const double pi = std::numbers::pi, R = p.body.radius, b = p.tca.outer_radius[0], a = p.tca.inner_radius[0];
  const auto n = static_cast<double>(count);
  const double heat = p.body.length * pi * (p.body.rho_c * (R * R - n * b * b) + p.tca.rho_c[0] * n * (b * b - a * a));
  EXPECT_NEAR(m.mass.sum() / heat, 1.0, 1e-9);
  EXPECT_NEAR(m.surface_conductance / (p.h * 2.0 * pi * R * p.body.length), 1.0, 1e-9);
  EXPECT_GT(m.mass.minCoeff(), 0.0);
}

TEST_P(Count, ElementsOfHigherOrderAgree) {
  Parameters p = parameters();
  const HeatMatrices coarse = must(resolved_matrices(p));
  EXPECT_LE(coarse.error, p.tolerance);
  if (count > 6) return;  // the rest is dear
  p.tolerance = 1e-6;
  Drive drive;
  for (std::size_t i = 0; i < count; ++i) drive.V[i][0] = 1.0 + static_cast<double>(i) / static_cast<double>(count);
  const double gap = largest_gap({level_of(p, coarse)}, run_of(p, 6), drive, 100.0);
  Trajectory run = run_of(p, 6);
  run.advance(drive, 1e5);
  EXPECT_LT(gap, 1e-4 * (run.observe(drive).rise[0]));
}

TEST_P(Count, EveryLevelReachesTheSameSteadyState) {
  Parameters p = parameters();
  Drive drive;
  drive.V[count - 1][0] = 2.0;
  PerTca expected{};
  for (Level level : {Level::reduced, Level::lumped, Level::full}) {
    p.level = level;
    Trajectory run = run_of(p, 4);
    run.advance(drive, 1e4);
    const Observation seen = run.observe(drive);
    EXPECT_NEAR(seen.loss / seen.power[count - 1], 1.0, 1e-4);
    if (level == Level::reduced) expected = seen.rise;
    // Where no positive network has the very steady state, lumped says how far off it is.
    const double slack = level == Level::lumped ? seen.bound : 0.0;
    for (std::size_t i = 0; i < count; ++i) EXPECT_NEAR(seen.rise[i], expected[i], 1e-4 * expected[i] + slack);
    EXPECT_NEAR(seen.rise[count - 1] / expected[count - 1], 1.0, 0.04);
  }
}

INSTANTIATE_TEST_SUITE_P(Thermal, Count, testing::Combine(testing::Values(1, 2, 3, 6, 12), testing::Bool()));

}  // namespace
}  // namespace thermal
