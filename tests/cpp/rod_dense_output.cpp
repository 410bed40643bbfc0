// Steps that cross communication points: what the host sees on the way, when they are made, and when they are void.
#include <gtest/gtest.h>

#include <cmath>

#include "integration/dense_output.hpp"
#include "rod_support.hpp"

using namespace rod;
using rod_test::bare_rod;
using rod_test::Bench;

namespace {

Bench released(double retardation) {
  Parameters p = bare_rod();
  p.planar = true;
  p.set(&Segment::order, 2);
  p.set(&Segment::retardation, retardation);
  Bench bench(p);
  bench.inputs.gravity[0][0] = 9.81;
  return bench;
}

void step(Bench& bench, double h, double tolerance) {
  ASSERT_EQ(step_rosenbrock(bench.rod, bench.inputs, h, tolerance, bench.state, bench.scratch).reached, h);
}

}  // namespace

TEST(RodDenseOutput, FollowsPolynomialsOfDegreeFive) {
  Bench bench = released(5e-3);
  const auto put = [](MotionState& moment, double t) {  // another one for every unknown
    for (int k = 0; k < moment.q.size(); ++k) {
      const double c = 1.0 + 0.3 * k, t2 = t * t, t3 = t2 * t;
      moment.q[k] = 0.1 + c * t - 2.0 * t2 + c * t3 - 3.0 * t2 * t2 + c * t3 * t2;
      moment.v[k] = c - 4.0 * t + 3.0 * c * t2 - 12.0 * t3 + 5.0 * c * t2 * t2;
      moment.a[k] = -4.0 + 6.0 * c * t - 36.0 * t2 + 20.0 * c * t3;
    }
  };
  constexpr double end = 0.6;
  put(bench.state, 0.0), put(bench.state.ahead, end);
  bench.state.time_ahead = end;
  Bench truth = released(5e-3);
  for (double t : {0.05, 0.2, 0.55}) {  // each from the one before
    interpolate_to(bench.rod, t - (end - bench.state.time_ahead), bench.state);
    put(truth.state, t);
    EXPECT_LT((bench.state.q - truth.state.q).norm(), 1e-13);
    EXPECT_LT((bench.state.v - truth.state.v).norm(), 1e-12);
    EXPECT_LT((bench.state.a - truth.state.a).norm(), 1e-10);
    EXPECT_NEAR(bench.state.time_ahead, end - t, 1e-15);
  }
}

TEST(RodDenseOutput, ShortCommunicationStepsCostLittleAndKeepTheTolerance) {
  for (double retardation : {0.0, 5e-3})
    for (double tolerance : {1e-2, 1e-4}) {
      SCOPED_TRACE(testing::Message() << "retardation " << retardation << ", tolerance " << tolerance);
      Bench seldom = released(retardation), often = released(retardation), fine = released(retardation);
      constexpr double h = 1e-3;
      double worst = 0.0, heat = 0.0;
      for (int i = 0; i < 200; ++i) {
        step(often, h, tolerance), step(fine, h, 1e-9);
        const Outputs a = often.outputs(), b = fine.outputs();
        worst = std::max(worst, std::hypot(a.tip_p[0] - b.tip_p[0], a.tip_p[2] - b.tip_p[2]));
        heat = std::max(heat, std::abs(often.state.dissipated - fine.state.dissipated));
      }
      EXPECT_LT(worst, 0.8 * tolerance * 0.04);
      EXPECT_LE(heat, 3.0 * tolerance * fine.state.dissipated);
      step(seldom, 200 * h, tolerance);
      const long looks = 200;  // of this test
      EXPECT_LT(often.scratch.evaluations() - looks, 1.2 * seldom.scratch.evaluations() + 40);
    }
}

TEST(RodDenseOutput, MovedInputsMakeItVoid) {
  Bench bench = released(5e-3);
  for (int i = 0; i < 40; ++i) step(bench, 1e-3, 1e-3);
  ASSERT_GT(bench.state.time_ahead, 0.0);
  Bench other = released(5e-3);
  other.memory = bench.memory;
  State(other.memory.data(), other.rod.unknowns()).time_ahead = 0.0;  // as if there had been nothing ahead
  State now(other.memory.data(), other.rod.unknowns());
  for (Bench* each : {&bench, &other}) each->inputs.T[1] = {each->inputs.T[1][0], 50.0, 0.0, 0.0};
  step(bench, 1e-3, 1e-3);
  step_rosenbrock(other.rod, other.inputs, 1e-3, 1e-3, now, other.scratch);
  EXPECT_EQ(bench.memory, other.memory);
  EXPECT_EQ(bench.state.time_ahead, 0.0);
  const long before = bench.scratch.evaluations();
  for (int i = 0; i < 5; ++i) {  // every communication step is one of the method's own
    bench.inputs.T[1] = {bench.inputs.T[1][0] + 0.05, 50.0, 0.0, 0.0};
    step(bench, 1e-3, 1e-3);
    EXPECT_EQ(bench.state.time_ahead, 0.0);
  }
  EXPECT_GE(bench.scratch.evaluations() - before, 5 * 8);
}

TEST(RodDenseOutput, RestStaysRest) {
  Parameters p;
  p.set(&Segment::retardation, 5e-3);
  Bench bench(p);
  bench.inputs.gravity[0][0] = 9.81;
  bench.inputs.T[0][0] = 330.0;
  ASSERT_TRUE(bench.solve_equilibrium());
  const Vector still = bench.state.q;
  for (int i = 0; i < 5000; ++i) {
    step(bench, 0.01, 1e-6);
    ASSERT_LT((bench.state.q - still).lpNorm<Eigen::Infinity>(), 1e-9) << "step " << i;
  }
  EXPECT_LT(bench.scratch.evaluations(), 5000);
}
