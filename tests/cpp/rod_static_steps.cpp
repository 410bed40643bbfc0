// Quasi-static steps: predicted starts and chord steps give the solution of Newton's method, its velocity and verdict.
#include <gtest/gtest.h>

#include <cmath>

#include "rod_support.hpp"

using namespace rod;
using rod_test::Bench;

namespace {

constexpr double h = 0.1;  // s

/// Loads that bend the rod by about a radian, and change by a tenth of that in 1 s.
Inputs bending(const Parameters& p, double time) {
  Inputs inputs = Bench::inputs_of(p);
  inputs.gravity[0] = {2.0 + 0.2 * time, 0.2};
  inputs.tip_force[1] = {2e-3 * std::sin(time), 2e-3 * std::cos(time), -2e-3 * std::sin(time)};
  inputs.T[2] = {298.15 + 20.0 + 3.0 * time, 3.0};
  return inputs;
}

Parameters exchanged(bool is) {
  Parameters p;
  if (is) p.closure = Closure::exchanged;
  return p;
}

}  // namespace

class RodStaticSteps : public testing::TestWithParam<bool> {};

TEST_P(RodStaticSteps, EndAtTheEquilibriumAndItsVelocity) {
  const Parameters p = exchanged(GetParam());
  Bench steps(p);
  steps.inputs = bending(p, 0.0);
  ASSERT_TRUE(steps.solve_equilibrium());
  for (int k = 0; k < 20; ++k) {
    SCOPED_TRACE(k);
    steps.inputs = bending(p, k * h);
    ASSERT_EQ(step_static(steps.rod, steps.inputs, h, steps.state, steps.scratch).reached, h);
    const Loads at_end = loads_at(steps.inputs, h);
    Workspace work;
    Vector r;
    steps.rod.static_residual(steps.state.q.data(), at_end, work, r);
    Matrix K;
    steps.rod.tangent(work, {.q = 1.0}, K);
    EXPECT_LT((K.lu().solve(r)).lpNorm<Eigen::Infinity>(), 1e-11) << "what Newton's method would still correct";
    Vector r_t;
    steps.rod.load_derivative(work, at_end, load_rates_at(steps.inputs, h), r_t);
    const Vector velocity = -K.lu().solve(r_t);
    EXPECT_LT((steps.state.v - velocity).lpNorm<Eigen::Infinity>(), 1e-8 * velocity.lpNorm<Eigen::Infinity>());
  }
}

INSTANTIATE_TEST_SUITE_P(Closures, RodStaticSteps, testing::Bool());

TEST(RodStaticSteps, TakeOneTangentAndFewResiduals) {
  const Parameters p;
  Bench bench(p);
  bench.inputs = bending(p, 0.0);
  ASSERT_TRUE(bench.solve_equilibrium());
  for (int k = 0; k < 5; ++k) {
    bench.inputs = bending(p, k * h);
    ASSERT_EQ(step_static(bench.rod, bench.inputs, h, bench.state, bench.scratch).reached, h);
  }
  const long before = bench.scratch.evaluations();
  bench.inputs = bending(p, 5 * h);
  ASSERT_EQ(step_static(bench.rod, bench.inputs, h, bench.state, bench.scratch).reached, h);
  EXPECT_LE(bench.scratch.evaluations() - before, 6);
}

TEST(RodStaticSteps, FarPredictionsAreNotFollowed) {
  const Parameters p;
  Bench one(p), other(p);
  for (Bench* bench : {&one, &other}) {
    bench->inputs = bending(p, 0.0);
    ASSERT_TRUE(bench->solve_equilibrium());
  }
  one.state.v.setConstant(1.0);    // predicts a tenth of a radian in every coefficient
  other.state.v.setConstant(1e6);  // predicts nonsense
  for (Bench* bench : {&one, &other}) {
    bench->inputs = bending(p, 0.0);
    ASSERT_EQ(step_static(bench->rod, bench->inputs, h, bench->state, bench->scratch).reached, h);
  }
  EXPECT_LT((one.state.q - other.state.q).lpNorm<Eigen::Infinity>(), 1e-11);
}
