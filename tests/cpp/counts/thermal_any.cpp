// The heat model for the number of TCAs this file is compiled for: uneven, unsorted azimuths, different resistances.
#include <gtest/gtest.h>

#include <numbers>

#include "thermal_scene.hpp"

namespace thermal {
namespace {

/// TCAs that crowd on one side as far as they fit, named in no order, each with its own resistance.
Parameters uneven() {
  Parameters p;
  p.tca.offset = 3e-3;
  for (std::size_t i = 0; i < kTcas; ++i) {
    const double place =
        static_cast<double>((5 * i + 2) % kTcas);  // a permutation, for no count is divisible by 5 but 5
    p.tca.azimuth[i] = 0.4 + 0.7 * (kTcas == 5 ? static_cast<double>(i) : place);
    p.tca.R[i] = 4.0 + static_cast<double>(i);
  }
  return p;
}

class Count : public testing::TestWithParam<bool> {
 protected:
  Parameters parameters() const { return GetParam() ? uneven() : Parameters{}; }
};

TEST_P(Count, AreasAreThoseOfCircles) {
  const Parameters p = parameters();
  const HeatMatrices m = must(heat_matrices(p, 6));
  const double pi = std::numbers::pi, R = p.body.radius, b = p.tca.outer_radius, a = p.tca.inner_radius;
  const double heat =
      p.body.length * pi * (p.body.rho_c * (R * R - kTcas * b * b) + p.tca.rho_c * kTcas * (b * b - a * a));
  EXPECT_NEAR(m.mass.sum() / heat, 1.0, 1e-9);
  EXPECT_NEAR(m.surface_conductance / (p.h * 2.0 * pi * R * p.body.length), 1.0, 1e-9);
  EXPECT_GT(m.mass.minCoeff(), 0.0);
}

TEST_P(Count, ElementsOfHigherOrderAgree) {
  Parameters p = parameters();
  const HeatMatrices coarse = must(resolved_matrices(p));
  p.tolerance = 1e-6;
  Drive drive;
  for (std::size_t i = 0; i < kTcas; ++i) drive.V[i][0] = 1.0 + static_cast<double>(i) / kTcas;
  const double gap = largest_gap({level_of(p, coarse)}, run_of(p, 6), drive, 100.0);
  Trajectory run = run_of(p, 6);
  run.advance(drive, 1e5);
  EXPECT_LT(gap, 1e-4 * (run.observe(drive).rise[0]));
}

TEST_P(Count, EveryLevelReachesTheSameSteadyState) {
  Parameters p = parameters();
  Drive drive;
  drive.V[kTcas - 1][0] = 2.0;
  PerTca expected{};
  for (Level level : {Level::reduced, Level::lumped, Level::full}) {
    p.level = level;
    Trajectory run = run_of(p, 4);
    run.advance(drive, 1e4);
    const Observation seen = run.observe(drive);
    EXPECT_NEAR(seen.loss / seen.power[kTcas - 1], 1.0, 1e-4);
    if (level == Level::reduced) expected = seen.rise;
    // Where no positive network has the very steady state, lumped says how far off it is.
    const double slack = level == Level::lumped ? seen.bound : 0.0;
    for (std::size_t i = 0; i < kTcas; ++i) EXPECT_NEAR(seen.rise[i], expected[i], 1e-4 * expected[i] + slack);
    EXPECT_NEAR(seen.rise[kTcas - 1] / expected[kTcas - 1], 1.0, 0.03);
  }
}

INSTANTIATE_TEST_SUITE_P(Thermal, Count, testing::Bool());

}  // namespace
}  // namespace thermal
