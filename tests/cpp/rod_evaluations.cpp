// The output `evaluations`: what a step counts, and that the count is part of the state.
#include <gtest/gtest.h>

#include <memory>

#include "probe/host.hpp"
#include "rod_support.hpp"

using namespace rod;
using rod_test::Bench;

namespace {

constexpr double h = 0.01;  // s

struct Case {
  bool dynamic;
  Method method;
  double tolerance = 1e-4;
};

std::unique_ptr<probe::Host> started(const Case& c) {
  auto host = std::make_unique<probe::Host>();
  host->set_boolean("dynamic", c.dynamic);
  host->set_integer("method", static_cast<int>(c.method));
  host->set("tolerance", c.tolerance);
  host->set("gravity[1]", 5.0);
  host->start();
  return host;
}

}  // namespace

TEST(RodEvaluations, AreCountedByEveryMethodAndRestored) {
  for (const Case& c : {Case{true, Method::backward_euler}, Case{true, Method::rosenbrock},
                        Case{true, Method::midpoint}, Case{true, Method::bdf}, Case{true, Method::pade_euler},
                        Case{true, Method::rosenbrock_3}, Case{false, Method::rosenbrock}}) {
    SCOPED_TRACE(testing::Message() << "method " << static_cast<int>(c.method) << ", dynamic " << c.dynamic);
    const auto host = started(c);
    EXPECT_EQ(host->get("evaluations") > 0.0, !c.dynamic) << "statics start at an equilibrium, which is counted";
    ASSERT_EQ(host->step(0.0, h), fmi2OK);
    const double before = host->get("evaluations");
    EXPECT_GT(before, 0.0);
    const std::vector<char> state = host->bytes();
    ASSERT_EQ(host->set("gravity[1]", 9.0), fmi2OK);
    host->get("tip.p[1]");
    EXPECT_EQ(host->get("evaluations"), before) << "outputs are not counted";
    ASSERT_EQ(host->step(h, h), fmi2OK);
    const double after = host->get("evaluations");
    EXPECT_GT(after, before);
    const auto other = started(c);
    ASSERT_EQ(other->restore(state), fmi2OK);
    EXPECT_EQ(other->get("evaluations"), before);
    ASSERT_EQ(other->set("gravity[1]", 9.0), fmi2OK);
    ASSERT_EQ(other->step(h, h), fmi2OK);
    EXPECT_EQ(other->get("evaluations"), after);
  }
}

TEST(RodEvaluations, OfOneStepAreItsStages) {
  Parameters p;
  Bench bench(p);
  bench.state.next_step = h;
  ASSERT_EQ(step_rosenbrock(bench.rod, bench.inputs, h, 1e-3, bench.state, bench.scratch).reached, h);
  EXPECT_EQ(bench.scratch.evaluations(), 8) << "one step at rest: the eight stages of RODAS5P, the first at its start";
  bench.inputs.T[0][1] = 1e-9;  // not still, for a step of its own
  ASSERT_EQ(step_rosenbrock_3(bench.rod, bench.inputs, h, 1e-3, bench.state, bench.scratch).reached, h);
  EXPECT_EQ(bench.scratch.evaluations(), 8 + 3) << "the four of RODAS3, the first two at its start";
  ASSERT_EQ(step_static(bench.rod, bench.inputs, h, bench.state, bench.scratch).reached, h);
  EXPECT_EQ(bench.scratch.evaluations(), 8 + 3 + 1)
      << "at an equilibrium: one iteration of Newton's method, whose correction is too small to need a check";
}

// Loads that jump set off fast modes, which damping ends within the first attempts: errors shrink far more slowly than
// with the fifth power of the step, by which nine attempts would be tried instead of six.
TEST(RodEvaluations, RejectedStepsShowTheOrderOfTheirErrors) {
  Parameters p;
  p.set(&Segment::order, 3), p.set(&Segment::retardation, 5e-3);
  Bench bench(p);
  bench.inputs.gravity[0][0] = 9.81;
  ASSERT_EQ(step_rosenbrock(bench.rod, bench.inputs, 1e-3, 1e-3, bench.state, bench.scratch).reached, 1e-3);
  EXPECT_LE(bench.scratch.evaluations(), 6 * 8 + 2);
}
