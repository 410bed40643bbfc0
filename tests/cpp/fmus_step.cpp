// Stepping: polynomial inputs, times, discarded and failed steps.
#include <cmath>

#include "probe/host.hpp"

namespace probe {
namespace {

/// A free mass of 2 kg: v' = force/2 is integrated exactly by the probe for forces up to third order.
class FreeMass : public testing::Test {
 protected:
  FreeMass() {
    host.set("mass", 2.0);
    host.set("stiffness", 0.0);
    host.set("damping", 0.0);
    host.start();
  }
  Host host;
};

TEST_F(FreeMass, SeesInputsAsPolynomialsOfThirdOrder) {
  const double f[] = {1.0, -3.0, 8.0, -30.0};
  host.set("force", f[0]);
  for (int order = 1; order <= 3; ++order) EXPECT_EQ(host.set_derivative("force", order, f[order]), fmi2OK);
  const double h = 0.5;
  EXPECT_EQ(host.step(0.0, h), fmi2OK);
  const double impulse = f[0] * h + f[1] * h * h / 2 + f[2] * h * h * h / 6 + f[3] * h * h * h * h / 24;
  EXPECT_NEAR(host.get("v"), impulse / 2.0, 1e-15);
  // Derivatives hold for one step; the input stays at its end value.
  const double end = f[0] + f[1] * h + f[2] * h * h / 2 + f[3] * h * h * h / 6;
  EXPECT_NEAR(host.get("force"), end, 1e-15);
  EXPECT_EQ(host.step(h, h), fmi2OK);
  EXPECT_NEAR(host.get("v"), (impulse + end * h) / 2.0, 1e-15);
}

TEST_F(FreeMass, TakesValueAndDerivativesOfAnInputInEitherOrder) {
  host.set_derivative("force", 1, 5.0);
  host.set("force", 1.0);
  EXPECT_EQ(host.step(0.0, 1.0), fmi2OK);
  EXPECT_NEAR(host.get("v"), (1.0 + 2.5) / 2.0, 1e-15);
  host.set("force", 0.0);
  EXPECT_EQ(host.step(1.0, 1.0), fmi2OK) << "derivatives hold for one step";
  EXPECT_NEAR(host.get("v"), (1.0 + 2.5) / 2.0, 1e-15);
}

TEST_F(FreeMass, DiscardsAStepInWhichDerivativesTakeAnInputOutOfItsRange) {
  host.set("force", 0.0);  // range -1e5 to 1e5
  host.set_derivative("force", 1, 3e5);
  EXPECT_EQ(host.step(0.0, 1.0), fmi2Discard);
  EXPECT_TRUE(host.said({"force", "3e+05", "1e+05", "smaller"}));
  double reached = kNaN;
  EXPECT_EQ(fmi2GetRealStatus(host.fmu, fmi2LastSuccessfulTime, &reached), fmi2OK);
  EXPECT_EQ(reached, 0.0);
  EXPECT_EQ(host.get("v"), 0.0);
  EXPECT_EQ(host.get("force"), 0.0);
  EXPECT_EQ(host.step(0.0, 1e-4), fmi2OK) << host.last();  // the remedy
  // Inside at both ends, outside between them.
  host.set("force", 0.0);
  host.set_derivative("force", 1, 4.8e5);
  host.set_derivative("force", 2, -9.6e5);
  EXPECT_EQ(host.step(1e-4, 1.0), fmi2Discard) << "120000 N at 0.5 s";
  // Beyond all doubles, for an input without a range.
  Host other;
  other.start();
  other.set_derivative("bias", 3, 1e308);
  EXPECT_EQ(other.step(0.0, 100.0), fmi2Discard);
  EXPECT_TRUE(other.said({"bias", "inf"}));
}

TEST_F(FreeMass, RefusesInputDerivativesThatAreNone) {
  EXPECT_EQ(host.set_derivative("force", 4, 1.0), fmi2Error);
  EXPECT_TRUE(host.said({"force", "order 4", "1 to 3"}));
  EXPECT_EQ(host.set_derivative("force", 0, 1.0), fmi2Error);
  EXPECT_EQ(host.set_derivative("force", 1, kNaN), fmi2Error);
  EXPECT_EQ(host.set_derivative("x", 1, 1.0), fmi2Error);
  EXPECT_EQ(host.set_derivative("mass", 1, 1.0), fmi2Error);
  const fmi2ValueReference vr[] = {reference("force"), reference("bias")};
  const int orders[] = {1, 4};
  const double values[] = {7.0, 7.0};
  EXPECT_EQ(fmi2SetRealInputDerivatives(host.fmu, vr, 2, orders, values), fmi2Error);
  EXPECT_EQ(host.step(0.0, 1.0), fmi2OK);
  EXPECT_EQ(host.get("v"), 0.0);
}

TEST_F(FreeMass, GivesOutputDerivativesOfFirstOrder) {
  host.set("force", 4.0);
  EXPECT_EQ(host.step(0.0, 1.0), fmi2OK);
  const fmi2ValueReference x = reference("x"), v = reference("v");
  const int first = 1, second = 2;
  double rate = kNaN;
  EXPECT_EQ(fmi2GetRealOutputDerivatives(host.fmu, &x, 1, &first, &rate), fmi2OK);
  EXPECT_EQ(rate, host.get("v"));
  EXPECT_EQ(fmi2GetRealOutputDerivatives(host.fmu, &x, 1, &second, &rate), fmi2OK);
  EXPECT_EQ(rate, 0.0) << "beyond maxOutputDerivativeOrder";
  EXPECT_EQ(fmi2GetRealOutputDerivatives(host.fmu, &v, 1, &first, &rate), fmi2OK);
  EXPECT_NEAR(rate, 4.0 / 2.0, 1e-11);
  const int none = 0;
  EXPECT_EQ(fmi2GetRealOutputDerivatives(host.fmu, &x, 1, &none, &rate), fmi2Error);
  const fmi2ValueReference input = reference("force");
  EXPECT_EQ(fmi2GetRealOutputDerivatives(host.fmu, &input, 1, &first, &rate), fmi2Error);
  EXPECT_TRUE(host.said({"force", "not an output"}));
}

/// Checks both schemes of the probe: one differentiates along its states, the other takes a trial step.
TEST(OutputDerivatives, FollowInputsThatActAtOnce) {
  for (const int scheme : {1, 2}) {
    Host host;
    host.set_integer("scheme", scheme);
    host.start();
    host.set("bias", 0.5);
    host.set_derivative("bias", 1, 3.0);
    host.set("force", 2.0);
    EXPECT_EQ(host.step(0.0, 0.25), fmi2OK);
    const double before = host.get("reading");
    const fmi2ValueReference vr[] = {reference("reading"), reference("v")};
    const int orders[] = {1, 1};
    double rates[2] = {kNaN, kNaN};
    ASSERT_EQ(fmi2GetRealOutputDerivatives(host.fmu, vr, 2, orders, rates), fmi2OK) << host.last();
    EXPECT_NEAR(rates[0], host.get("v") + 3.0, 1e-6);
    EXPECT_NEAR(rates[1], 2.0 - 4.0 * host.get("x") - 0.1 * host.get("v"), 1e-6);  // one mass, one spring
    EXPECT_EQ(host.get("reading"), before) << "and leave no trace";
    EXPECT_EQ(host.step(0.25, 0.25), fmi2OK);
  }
}

TEST(Values, ThatAreNotFiniteNeverLeaveWithOk) {
  Host host;
  host.set("bias", 1.7e308);  // the start position too: reading = x + bias is beyond all doubles
  host.start();
  const auto vr = reference("reading");
  double value = 0.0;
  EXPECT_EQ(fmi2GetReal(host.fmu, &vr, 1, &value), fmi2Discard);
  EXPECT_TRUE(host.said({"reading", "not finite"}));
  EXPECT_EQ(host.get("x"), 1.7e308);
}

TEST(Clock, AllowsRoundingButNoMoreThanAShareOfTheStep) {
  Host host;
  fmi2SetupExperiment(host.fmu, fmi2False, 0.0, 1.7e9, fmi2False, 0.0);  // seconds since 1970
  host.start();
  double t = 1.7e9;
  const double h = 1e-3;
  for (int i = 0; i < 2000; ++i, t += h) ASSERT_EQ(host.step(t, h), fmi2OK) << host.last();
  EXPECT_EQ(host.step(t + 0.1 * h, h), fmi2Error) << "2000 roundings of 1.7e9 s would exceed the step itself";
  EXPECT_TRUE(host.said({"communication point"}));
  EXPECT_EQ(host.step(t, 1e-7), fmi2Error);
  EXPECT_TRUE(host.said({"rounding", "start the clock near 0"}));
}

TEST_F(FreeMass, DiscardedStepIsValidAtTheLastSuccessfulTimeAndCanBeFinished) {
  const auto push = [](Host& h) {
    h.set("force", 1.0);
    h.set_derivative("force", 1, -3.0);
    h.set_derivative("force", 2, 8.0);
    h.set_derivative("force", 3, -30.0);
  };
  Host whole;
  whole.set("mass", 2.0);
  whole.set("stiffness", 0.0);
  whole.set("damping", 0.0);
  whole.start();
  push(whole);
  EXPECT_EQ(whole.step(0.0, 0.5), fmi2OK);

  host.set("longest_step", 0.2);
  push(host);
  EXPECT_EQ(host.step(0.0, 0.5), fmi2Discard);
  EXPECT_EQ(host.messages.back().category, "logStatusDiscard");
  EXPECT_EQ(host.messages.back().status, fmi2Discard);
  EXPECT_TRUE(host.said({"0.5 s came to 0.2 s", "ask for a smaller step"}));
  double t = kNaN;
  EXPECT_EQ(fmi2GetRealStatus(host.fmu, fmi2LastSuccessfulTime, &t), fmi2OK);
  EXPECT_EQ(t, 0.2);
  fmi2Status status = fmi2OK;
  EXPECT_EQ(fmi2GetStatus(host.fmu, fmi2DoStepStatus, &status), fmi2OK);
  EXPECT_EQ(status, fmi2Discard);
  fmi2Boolean ended = fmi2True;
  EXPECT_EQ(fmi2GetBooleanStatus(host.fmu, fmi2Terminated, &ended), fmi2OK);
  EXPECT_EQ(ended, fmi2False);
  EXPECT_NEAR(host.get("v"), (0.2 - 3.0 * 0.02 + 8.0 * 0.008 / 6 - 30.0 * 0.0016 / 24) / 2.0, 1e-15);
  // The rest of the step sees the rest of the polynomial.
  host.set("longest_step", 1.0);
  EXPECT_EQ(host.step(0.2, 0.3), fmi2OK);
  EXPECT_NEAR(host.get("v"), whole.get("v"), 1e-15);
  EXPECT_NEAR(host.get("x"), whole.get("x"), 1e-6);  // fourth order in the substep
  EXPECT_NEAR(host.get("force"), whole.get("force"), 1e-14);
  EXPECT_EQ(fmi2GetStatus(host.fmu, fmi2DoStepStatus, &status), fmi2OK);
  EXPECT_EQ(status, fmi2OK);
}

TEST_F(FreeMass, DiscardedStepCanBeTakenBack) {
  host.set("longest_step", 0.2);
  host.set("force", 1.0);
  fmi2FMUstate before = host.save();
  EXPECT_EQ(host.step(0.0, 0.5), fmi2Discard);
  EXPECT_EQ(host.restore(before), fmi2OK);
  EXPECT_EQ(host.step(0.0, 0.2), fmi2OK);
}

TEST_F(FreeMass, FailedStepKeepsTheStateAndSaysWhyOnce) {
  host.set("force", 1.0);
  EXPECT_EQ(host.step(0.0, 0.5), fmi2OK);
  const double x = host.get("x"), v = host.get("v");
  fmi2FMUstate before = host.save();
  host.set("breaking_force", 2.0);
  host.set_derivative("force", 1, 4.0);
  host.messages.clear();
  EXPECT_EQ(host.step(0.5, 0.5), fmi2Error);  // breaks half way
  ASSERT_EQ(host.messages.size(), 1u);
  EXPECT_TRUE(host.said({"fmi2DoStep", "breaks the chain"}));
  EXPECT_EQ(host.get("x"), x);
  EXPECT_EQ(host.get("v"), v);
  EXPECT_EQ(host.step(0.5, 0.1), fmi2Error);
  EXPECT_TRUE(host.said({"not allowed in state 'error'"}));
  EXPECT_EQ(host.restore(before), fmi2OK);
  EXPECT_EQ(host.step(0.5, 0.5), fmi2OK);
}

TEST_F(FreeMass, AnExceptionOfNoKnownTypeIsFatalToTheInstanceOnly) {
  host.set("force", 6e4);
  EXPECT_EQ(host.step(0.0, 0.1), fmi2Fatal);
  EXPECT_EQ(host.messages.back().category, "logStatusFatal");
  EXPECT_EQ(host.step(0.0, 0.1), fmi2Error);
  EXPECT_TRUE(host.said({"'fatal'"}));
  EXPECT_EQ(fmi2Reset(host.fmu), fmi2Error);
  Host other;
  other.start();
  EXPECT_EQ(other.step(0.0, 0.1), fmi2OK);
}

TEST_F(FreeMass, RefusesTimesAndStepSizesThatAreNone) {
  for (const double h : {0.0, -0.1, kNaN, kInfinity, 5e-324, 1e300}) {
    EXPECT_EQ(host.step(0.0, h), fmi2Error);
    EXPECT_TRUE(host.said({"step size", "allowed: 1e-40 s to 1e+40 s"}));
  }
  for (const double t : {0.1, -0.1, kNaN, kInfinity}) EXPECT_EQ(host.step(t, 0.1), fmi2Error);
  EXPECT_EQ(host.step(0.1, 0.1), fmi2Error);
  EXPECT_TRUE(host.said({"communication point 0.1 s", "is at 0 s"}));
  EXPECT_EQ(host.step(0.0, 0.1), fmi2OK);
}

TEST_F(FreeMass, AcceptsTimesThatDifferByRounding) {
  const double h = 0.1;
  for (int i = 0; i < 10000; ++i) ASSERT_EQ(host.step(i * h, h), fmi2OK) << host.last();
  double t = 1000.0;  // another host adds up
  for (int i = 0; i < 10000; ++i, t += h) ASSERT_EQ(host.step(t, h), fmi2OK) << host.last();
  EXPECT_EQ(host.step(t + 1e-6, h), fmi2Error);
}

TEST(Reset, GoesBackToTheStartValues) {
  Host fresh, used;
  used.set("mass", 3.0);
  used.set_integer("masses", 4);
  fmi2SetupExperiment(used.fmu, fmi2False, 0.0, 7.0, fmi2False, 0.0);
  used.start();
  used.set("force", 2.0);
  EXPECT_EQ(used.step(7.0, 0.3), fmi2OK);
  EXPECT_EQ(fmi2Reset(used.fmu), fmi2OK);
  for (Host* host : {&fresh, &used}) {
    host->start();
    host->set("force", 1.0);
    EXPECT_EQ(host->step(0.0, 0.5), fmi2OK);
  }
  EXPECT_EQ(fresh.get("x"), used.get("x"));
  EXPECT_EQ(used.get("mass"), 1.0);
}

TEST(Convergence, OfTheProbeIsSecondAndFourthOrder) {
  for (const int scheme : {1, 2}) {
    const auto solve = [scheme](int steps) {
      Host host;
      host.set_integer("scheme", scheme);
      host.set("bias", 1.0);
      host.start();
      for (int i = 0; i < steps; ++i) EXPECT_EQ(host.step(i * 4.0 / steps, 4.0 / steps), fmi2OK);
      return host.get("x");
    };
    // x'' = -4 (2 x - x) - 0.1 x': the last mass hangs on a spring to its left only
    const double decay = 0.05, omega = std::sqrt(4.0 - decay * decay);
    const double exact = std::exp(-decay * 4.0) * (std::cos(omega * 4.0) + decay / omega * std::sin(omega * 4.0));
    const double order = std::log2(std::abs(solve(2) - exact) / std::abs(solve(4) - exact));
    EXPECT_NEAR(order, 2.0 * scheme, 0.15);
  }
}

}  // namespace
}  // namespace probe
