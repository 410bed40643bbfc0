// What the paper's scheme keeps: balances and loads, pose and strain, energy.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "rod_pade_support.hpp"

using namespace rod_test;
constexpr int kTcaDim = 3;

TEST(RodPade, TipBalanceHasTheRightSign) {
  // Unloaded but hot: W_tot = K (xi - xi*) + sum N [r x t; t] vanishes all along. With the sign of Eq. 23 as printed
  // the base would carry 2 sum N [r x t; t] instead, which is far from nothing here.
  Parameters p;
  GridBench bench(p, 21);
  bench.inputs.T[0][0] = 350.0;
  ASSERT_TRUE(bench.solve_equilibrium());
  const Section section = Section::of(p);
  const Outputs y = bench.outputs();
  for (int k = 0; k < bench.rod.points(); ++k) {
    pade::Vector6 elastic, actuators = pade::Vector6::Zero();
    for (int c = 0; c < 6; ++c) elastic[c] = section.stiffness[c] * (bench.state.strain(k)[c] - section.reference[c]);
    for (int i = 0; i < kTcaDim; ++i) {
      pade::Vector3 r;
      const pade::Vector3 t = bench.u(k, i, r).normalized();
      actuators.head<3>() += y.N[i] * r.cross(t);
      actuators.tail<3>() += y.N[i] * t;
    }
    EXPECT_LT((elastic + actuators).head<3>().norm(), 1e-12);
    EXPECT_LT((elastic + actuators).tail<3>().norm(), 1e-10);
    EXPECT_GT(2 * actuators.head<3>().norm(), 1e-4);
    EXPECT_GT(2 * actuators.tail<3>().norm(), 1e-2);
  }
}

TEST(RodPade, TipLoadsAreDeadLoadsOfTheFixedFrame) {
  Parameters p = bare_rod();
  GridBench bench(p, 81);
  bench.inputs.tip_moment[1][0] = 2 * M_PI * Section::of(p).stiffness[1] / p.length();
  ASSERT_TRUE(bench.solve_equilibrium());
  for (double x : bench.outputs().tip_p) EXPECT_NEAR(x, 0.0, 1e-6 * p.length());  // the rod closes to a circle

  p.set(&Segment::order, 7);
  Bench other(p);
  GridBench pulled(p, 41);
  other.inputs.tip_force[1][0] = pulled.inputs.tip_force[1][0] = 0.02;
  other.inputs.tip_force[2][0] = pulled.inputs.tip_force[2][0] = -0.01;
  ASSERT_TRUE(pulled.solve_equilibrium() && other.solve_equilibrium());
  EXPECT_LT(difference(pulled.outputs(), other.outputs()), 1e-7);
}

TEST(RodPade, StretchEvolvedInTimeFollowsTheStrain) {
  // eps' falls short of |u| by the squares of the angles that u turned: first order in the step.
  const auto gap = [](int steps) {
    GridBench bench(twisted(5e-3), 15);
    shake(bench.inputs, 0.04, steps, [&bench](double h) { bench.step(h); });
    double worst = 0.0;
    for (int k = 0; k < bench.rod.points(); ++k)
      for (int i = 0; i < kTcaDim; ++i) {
        pade::Vector3 r;
        worst = std::max(worst, std::abs(bench.state.stretch(k)[i] - bench.u(k, i, r).norm()));
      }
    return worst;
  };
  const double coarse = gap(80), fine = gap(160);
  EXPECT_LT(coarse, 1e-5);
  EXPECT_GT(fine, 1e-12) << "evolved, not computed from the strain";
  EXPECT_NEAR(coarse / fine, 2.0, 0.2);
}

TEST(RodPade, PoseBelongsToTheStrainAndStaysOnTheGroup) {
  GridBench bench(twisted(0.0), 41);
  shake(bench.inputs, 0.04, 40, [&bench](double h) { bench.step(h); });
  for (int k = 0; k < 41; ++k) EXPECT_NEAR(bench.state.quaternion(k).norm(), 1.0, 1e-14);
  // Central differences of the pose give the strain back.
  const double spacing = bench.parameters.length() / 40;
  for (int k = 1; k < 40; ++k) {
    const auto q = [&](int j) {
      const auto c = bench.state.quaternion(j);
      return Eigen::Quaterniond(c[0], c[1], c[2], c[3]);
    };
    const Eigen::AngleAxisd turn(q(k - 1).conjugate() * q(k + 1));
    const pade::Vector3 kappa = turn.angle() * turn.axis() / (2 * spacing);
    EXPECT_LT((kappa - bench.state.strain(k).head<3>()).norm(), 0.1);  // 1/m, of some 20
    const pade::Vector3 slope = (bench.state.position(k + 1) - bench.state.position(k - 1)) / (2 * spacing);
    EXPECT_LT((q(k).conjugate() * slope - bench.state.strain(k).tail<3>()).norm(), 2e-3);
  }
}

TEST(RodPade, DisplacementRateIsItsDifferenceQuotient) {
  GridBench bench(Parameters{}, 11);
  bench.inputs.gravity[0][0] = 9.81;
  for (int i = 0; i < 5; ++i) bench.step(1e-3);
  const Outputs before = bench.outputs();
  bench.step(1e-4);
  const Outputs after = bench.outputs();
  for (std::size_t i = 0; i < kTcas; ++i) {
    EXPECT_NEAR(after.delta_rate[i], (after.delta[i] - before.delta[i]) / 1e-4, 1e-9);
    EXPECT_GT(std::abs(after.delta_rate[i]), 1e-4);
  }
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(after.tip_v[c], (after.tip_p[c] - before.tip_p[c]) / 1e-4, 1e-2 * std::abs(after.tip_v[0]));
}

TEST(RodPade, ExchangedTensionsFollowTheGuessOnly) {
  Parameters p;
  GridBench inside(p, 21);
  inside.inputs.gravity[0][0] = 9.81;
  inside.inputs.T[1][0] = 330.0;
  p.closure = Closure::exchanged;
  GridBench exchanged(p, 21);
  exchanged.inputs = inside.inputs;
  ASSERT_TRUE(inside.solve_equilibrium());
  const Outputs truth = inside.outputs();
  for (std::size_t i = 0; i < kTcas; ++i) exchanged.inputs.delta_guess[i][0] = truth.delta[i];
  ASSERT_TRUE(exchanged.solve_equilibrium());
  EXPECT_LT(difference(exchanged.outputs(), truth), 1e-9);
  exchanged.inputs.delta_guess[0][0] += 1e-3;
  const Outputs off = exchanged.outputs();
  EXPECT_NEAR(off.N[0] - truth.N[0], TcaLaw(p, 0).stiffness() * 1e-3, 1e-6);
  EXPECT_NEAR(off.delta[0], truth.delta[0], 1e-9) << "delta belongs to the shape";
}

TEST(RodPade, FreeMotionLosesEnergy) {
  for (double retardation : {0.0, 5e-3}) {
    Parameters p;
    p.set(&Segment::retardation, retardation);
    GridBench bench(p, 21);
    bench.inputs.gravity[0][0] = 9.81;
    bench.inputs.T[1][0] = 320.0;
    const auto total = [&bench] {
      const Outputs y = bench.outputs();
      return y.energy_kinetic + y.energy_elastic + y.energy_gravity + y.energy_tca + y.energy_dissipated;
    };
    const double start = total();
    double last = start, heat = 0.0;
    for (int i = 0; i < 200; ++i) {
      bench.step(1e-3);
      EXPECT_LT(total(), last + 1e-9 * start);
      EXPECT_GE(bench.outputs().energy_dissipated, heat);
      last = total();
      heat = bench.outputs().energy_dissipated;
    }
    EXPECT_LT(last, start);
    EXPECT_EQ(heat > 1e-6, retardation > 0.0);
  }
}
