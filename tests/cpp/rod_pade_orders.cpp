// The paper's scheme as it is refined: its orders, the strain polynomials, independent numbers.
#include <gtest/gtest.h>

#include <cmath>

#include "rod_pade_support.hpp"

using namespace rod_test;

TEST(RodPade, IsOfFourthOrderInSpace) {
  for (double retardation : {0.0, 5e-3}) {
    const Parameters p = twisted(retardation);
    const Outputs fine = shaken(p, 161, 20);
    double last = 0.0;
    for (int points : {11, 21, 41}) {
      const double error = difference(shaken(p, points, 20), fine);
      if (last > 0.0) {
        EXPECT_GT(std::log2(last / error), 3.7) << points << " points, retardation " << retardation;
        EXPECT_LT(std::log2(last / error), 4.5) << points << " points, retardation " << retardation;
      }
      last = error;
    }
    EXPECT_LT(last, 1e-9);
  }
}

TEST(RodPade, IsOfFirstOrderInTime) {
  for (double retardation : {0.0, 5e-3}) {
    const Parameters p = twisted(retardation);
    const Outputs fine = shaken(p, 15, 2560);
    double last = 0.0;
    for (int steps : {40, 80, 160}) {
      const double error = difference(shaken(p, 15, steps), fine);
      if (last > 0.0) {
        EXPECT_GT(std::log2(last / error), 0.9) << steps << " steps, retardation " << retardation;
        EXPECT_LT(std::log2(last / error), 1.2) << steps << " steps, retardation " << retardation;
      }
      last = error;
    }
  }
}

TEST(RodPade, MeetsTheStrainPolynomialsAsTheStepShrinks) {
  Parameters p = twisted(5e-3);
  p.set(&Segment::order, 6);
  Bench other(p);
  shake(other.inputs, 0.04, 40, [&other](double h) {
    ASSERT_EQ(step_rosenbrock(other.rod, other.inputs, h, 1e-8, other.state, other.scratch).reached, h);
  });
  const Outputs truth = other.outputs();
  const Outputs coarse = shaken(p, 41, 320), fine = shaken(p, 41, 640);
  EXPECT_LT(difference(fine, truth), 0.55 * difference(coarse, truth));
  // Richardson's extrapolation to step 0.
  Outputs limit = fine;
  for (std::size_t m = 0; m < kShapeStations; ++m)
    for (int c = 0; c < 3; ++c) limit.shape[m][c] = 2 * fine.shape[m][c] - coarse.shape[m][c];
  for (std::size_t i = 0; i < kTcas; ++i) limit.delta[i] = 2 * fine.delta[i] - coarse.delta[i];
  EXPECT_LT(difference(limit, truth), 0.02 * difference(fine, truth));
}

TEST(RodPade, DampedReleaseAgainstTheReference) {
  const auto row = rod_test::read_csv("rod_release.csv").front();
  Parameters p = bare_rod();
  p.set(&Segment::retardation, 5e-3);
  const auto tip = [&](int steps) {  // mm
    GridBench bench(p, 21);
    bench.inputs.gravity[0][0] = 9.81;
    for (int i = 0; i < steps; ++i) bench.step(row[0] / steps);
    const Outputs y = bench.outputs();
    return Eigen::Vector2d(1e3 * y.tip_p[2], 1e3 * y.tip_p[0]);
  };
  const Eigen::Vector2d truth(row[3], row[4]), coarse = tip(200), fine = tip(400);
  EXPECT_LT((fine - truth).norm(), 1e-2);
  EXPECT_NEAR((coarse - truth).norm() / (fine - truth).norm(), 2.0, 0.1);
  EXPECT_LT((2 * fine - coarse - truth).norm(), 3e-4);
}

TEST(RodPade, ComesToRestAtTheReferenceEquilibria) {
  for (const auto& row : rod_test::read_csv("rod_static.csv")) {
    Parameters p;
    p.set(&Segment::retardation, 20e-3);
    const auto error = [&row](GridBench& bench) {
      const Outputs y = bench.outputs();
      double worst = 0.0;
      for (int c = 0; c < 3; ++c)
        worst = std::max({worst, std::abs(y.tip_p[c] - row[7 + c]), std::abs(y.delta[c] - row[13 + c])});
      return worst;
    };
    const auto load = [&row](GridBench& bench) {
      for (int c = 0; c < 3; ++c) bench.inputs.gravity[c][0] = row[1 + c];
      for (std::size_t i = 0; i < kTcas; ++i) bench.inputs.T[i][0] = row[4 + i] + 273.15;
    };
    const auto after_damped_motion = [&](double h) {
      GridBench bench(p, 41);
      for (int i = 0; i < std::lround(1.0 / h); ++i) {  // loads grow for a second
        const double t = i * h;
        for (int c = 0; c < 3; ++c) bench.inputs.gravity[c] = {row[1 + c] * t, row[1 + c], 0.0, 0.0};
        for (std::size_t k = 0; k < kTcas; ++k)
          bench.inputs.T[k] = {298.15 + (row[4 + k] - 25) * t, row[4 + k] - 25, 0.0, 0.0};
        bench.step(h);
      }
      bench.inputs = Inputs{};
      load(bench);
      for (int i = 0; i < std::lround(1.0 / h); ++i) bench.step(h);
      EXPECT_LT(bench.outputs().energy_kinetic, 1e-20);
      return error(bench);
    };
    GridBench placed(p, 41);
    load(placed);
    ASSERT_TRUE(placed.solve_equilibrium());
    EXPECT_LT(error(placed), 1e-8);
    // After motion, what eps' fell short on the way remains; it shrinks with the step.
    const double coarse = after_damped_motion(10e-3), fine = after_damped_motion(5e-3);
    EXPECT_LT(coarse, 1e-6);
    EXPECT_TRUE(fine < 0.6 * coarse || fine < 1e-8) << fine << " m after " << coarse << " m";
  }
}

TEST(RodPade, EquilibriaConvergeWithFourthOrder) {
  const auto tip = [](int points) {
    GridBench bench(twisted(0.0), points);
    bench.inputs.gravity[0][0] = 9.81;
    bench.inputs.T[0][0] = 340.0;
    EXPECT_TRUE(bench.solve_equilibrium());
    return bench.outputs();
  };
  const Outputs fine = tip(161);
  EXPECT_GT(std::log2(difference(tip(11), fine) / difference(tip(21), fine)), 3.5);
  EXPECT_GT(std::log2(difference(tip(21), fine) / difference(tip(41), fine)), 3.5);

  Parameters p = twisted(0.0);
  p.set(&Segment::order, 7);
  Bench other(p);
  other.inputs.gravity[0][0] = 9.81;
  other.inputs.T[0][0] = 340.0;
  ASSERT_TRUE(other.solve_equilibrium());
  EXPECT_LT(difference(fine, other.outputs()), 1e-8);
}
