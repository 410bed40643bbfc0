// Model exchange and directional derivatives of the probe, whose equations are linear and known.
#include "probe/data.hpp"
#include "probe/host.hpp"

namespace probe {
namespace {

constexpr std::size_t kStates = 2 * kMostMasses;

class Exchange : public testing::Test {
 protected:
  void start(int masses = 2) {
    host.set_integer("masses", masses);
    host.start();
    fmi2EventInfo info{fmi2True, fmi2True, fmi2True, fmi2True, fmi2True, 1.0};
    EXPECT_EQ(fmi2NewDiscreteStates(host.fmu, &info), fmi2OK);
    EXPECT_FALSE(info.newDiscreteStatesNeeded || info.terminateSimulation || info.nextEventTimeDefined ||
                 info.valuesOfContinuousStatesChanged || info.nominalsOfContinuousStatesChanged);
    EXPECT_EQ(fmi2EnterContinuousTimeMode(host.fmu), fmi2OK);
  }
  fmi2Status put(const std::vector<double>& x) { return fmi2SetContinuousStates(host.fmu, x.data(), x.size()); }
  std::vector<double> states() {
    std::vector<double> x(kStates, kNaN);
    EXPECT_EQ(fmi2GetContinuousStates(host.fmu, x.data(), x.size()), fmi2OK) << host.last();
    return x;
  }
  std::vector<double> derivatives() {
    std::vector<double> dx(kStates, kNaN);
    EXPECT_EQ(fmi2GetDerivatives(host.fmu, dx.data(), dx.size()), fmi2OK) << host.last();
    return dx;
  }
  double directional(const std::string& unknown, const std::string& known, double seed = 1.0) {
    const auto u = reference(unknown), k = reference(known);
    double result = kNaN;
    EXPECT_EQ(fmi2GetDirectionalDerivative(host.fmu, &u, 1, &k, 1, &seed, &result), fmi2OK) << host.last();
    return result;
  }

  /// A step with evaluations at times [s] under forces [N], and the force at its end. Whether an event is asked for.
  bool asks_for_event(const std::vector<std::pair<double, double>>& evaluations, double end) {
    for (const auto& [time, force] : evaluations) {
      EXPECT_EQ(fmi2SetTime(host.fmu, time), fmi2OK);
      host.set("force", force);
      derivatives();
    }
    host.set("force", end);
    fmi2Boolean event = fmi2True, terminate = fmi2True;
    EXPECT_EQ(fmi2CompletedIntegratorStep(host.fmu, fmi2True, &event, &terminate), fmi2OK);
    EXPECT_FALSE(terminate);
    return event;
  }

  Host host{false, fmi2ModelExchange};
  const std::size_t v = kMostMasses;  // where velocities start
};

TEST_F(Exchange, DerivativesAreThoseOfTheEquations) {
  start();
  std::vector<double> x(kStates, 0.0);
  x[0] = 0.3, x[1] = -0.1, x[v] = 2.0, x[v + 1] = -1.0;
  EXPECT_EQ(put(x), fmi2OK);
  host.set("force", 0.7);
  EXPECT_EQ(states(), x);
  const auto dx = derivatives();
  EXPECT_EQ(dx[0], 2.0);
  EXPECT_EQ(dx[1], -1.0);
  EXPECT_DOUBLE_EQ(dx[v], 4.0 * (0.0 - 2 * 0.3 - 0.1) - 0.1 * 2.0);
  EXPECT_DOUBLE_EQ(dx[v + 1], 4.0 * (0.3 + 0.1) + 0.1 * 1.0 + 0.7);
  EXPECT_EQ(std::ranges::count(dx, 0.0), static_cast<long>(kStates - 4)) << "states that are not in use stand still";
  EXPECT_EQ(host.get("x"), -0.1);
  EXPECT_EQ(host.get("velocity[1]"), 2.0);
  EXPECT_EQ(host.get("der(velocity[2])"), dx[v + 1]);
}

TEST_F(Exchange, SetsBackAndSerialisesItsStates) {
  start();
  std::vector<double> x(kStates, 0.0), other(kStates, 0.0);
  x[0] = 0.3, other[1] = 0.2;
  put(x);
  host.set("force", 0.7);
  fmi2SetTime(host.fmu, 0.5);
  const auto dx = derivatives();
  const auto bytes = host.bytes();
  put(other);
  host.set("force", 0.0);
  EXPECT_NE(derivatives(), dx);
  EXPECT_EQ(host.restore(bytes), fmi2OK);
  EXPECT_EQ(derivatives(), dx);
  Host fresh(false, fmi2ModelExchange), slave;
  ASSERT_EQ(fresh.restore(bytes), fmi2OK) << fresh.last();
  std::vector<double> there(kStates);
  EXPECT_EQ(fmi2GetDerivatives(fresh.fmu, there.data(), there.size()), fmi2OK);
  EXPECT_EQ(there, dx);
  EXPECT_EQ(slave.restore(bytes), fmi2Error);
  EXPECT_TRUE(slave.said({"an instance for model exchange", "same interface"}));
}

TEST_F(Exchange, AsksForAnEventWhereAHeldInputHasJumped) {
  start();
  EXPECT_FALSE(asks_for_event({{0.05, 1.0}, {0.1, 1.0}}, 1.0));
  EXPECT_TRUE(asks_for_event({{0.15, 1.0}, {0.2, 1.0}}, 2.0));
  fmi2EventInfo info{};
  EXPECT_EQ(fmi2EnterEventMode(host.fmu), fmi2OK);
  EXPECT_EQ(fmi2NewDiscreteStates(host.fmu, &info), fmi2OK);
  EXPECT_EQ(fmi2EnterContinuousTimeMode(host.fmu), fmi2OK);
  EXPECT_TRUE(asks_for_event({{0.25, 2.0}, {0.3, 2.0}}, 3.0));
}

TEST_F(Exchange, AsksForNoEventWhereInputsMoveWithTime) {
  start();
  EXPECT_FALSE(asks_for_event({{0.05, 0.5}, {0.1, 1.0}}, 1.0)) << "a one-step method";
  EXPECT_FALSE(asks_for_event({{0.2, 2.0}}, 2.0)) << "a multistep method";
  EXPECT_FALSE(asks_for_event({{0.3, 3.0}}, 3.0));
}

TEST_F(Exchange, AsksEulersMethodForNoEventWhereInputsMoveWithTime) {
  start();
  for (int k = 0; k < 4; ++k) EXPECT_FALSE(asks_for_event({{0.1 * k, k}}, k + 1.0)) << k;
}

TEST_F(Exchange, DerivativesWithoutAnAnswerAreDiscarded) {
  start();
  host.set("force", 2e3);  // breaks the chain
  std::vector<double> dx(kStates);
  EXPECT_EQ(fmi2GetDerivatives(host.fmu, dx.data(), dx.size()), fmi2Discard);
  EXPECT_TRUE(host.said({"fmi2GetDerivatives", "t = 0 s", "broken"}));
  host.set("force", 0.0);
  derivatives();
}

TEST_F(Exchange, RefusesWhatIsNoState) {
  start();
  const auto before = states();
  auto bad = before;
  bad[1] = kNaN;
  EXPECT_EQ(put(bad), fmi2Error);
  EXPECT_TRUE(host.said({"position[2]", "nan", "nothing was changed"}));
  bad.resize(3);
  EXPECT_EQ(put(bad), fmi2Error);
  EXPECT_TRUE(host.said({"3 states", std::to_string(kStates)}));
  EXPECT_EQ(fmi2SetTime(host.fmu, kInfinity), fmi2Error);
  EXPECT_EQ(states(), before);
}

TEST_F(Exchange, TakesStatesByTheirNamesBetweenSteps) {
  fmi2EnterInitializationMode(host.fmu);
  EXPECT_EQ(host.set("position[1]", 1.0), fmi2Error);
  EXPECT_TRUE(host.said({"position[1]", "calculated", "continuous-time mode"}));
  EXPECT_EQ(derivatives(), std::vector<double>(kStates, 0.0)) << "allowed in initialization mode";
  EXPECT_EQ(fmi2ExitInitializationMode(host.fmu), fmi2OK);
  EXPECT_EQ(host.set("position[1]", 0.5), fmi2OK) << "event mode";
  EXPECT_EQ(states()[0], 0.5);
  EXPECT_EQ(fmi2EnterContinuousTimeMode(host.fmu), fmi2OK);
  EXPECT_EQ(host.set("position[1]", 1.0), fmi2OK);
  EXPECT_EQ(states()[0], 1.0);
  EXPECT_EQ(host.get("der(velocity[1])"), -4.0);
  EXPECT_EQ(host.set("tolerance", 1e-3), fmi2OK) << "optimisers set tunable parameters where they evaluate";
  EXPECT_EQ(host.set("mass", 2.0), fmi2Error);
  EXPECT_TRUE(host.said({"mass", "fixed parameter"}));
}

TEST_F(Exchange, EndsAtTheStopTime) {
  fmi2SetupExperiment(host.fmu, fmi2False, 0.0, 0.0, fmi2True, 1.0);
  fmi2EnterInitializationMode(host.fmu);
  EXPECT_EQ(fmi2ExitInitializationMode(host.fmu), fmi2OK);
  EXPECT_EQ(fmi2EnterContinuousTimeMode(host.fmu), fmi2OK);
  EXPECT_EQ(fmi2SetTime(host.fmu, 1.0), fmi2OK);
  EXPECT_EQ(fmi2SetTime(host.fmu, 1.02), fmi2OK) << "as CVODE looks past the last point";
  EXPECT_EQ(fmi2SetTime(host.fmu, 2.0), fmi2Error);
  EXPECT_TRUE(host.said({"time 2 s", "stop time 1 s"}));
}

TEST_F(Exchange, OfWhatHasNoStatesEndsInitialisationWithTheReason) {
  host.set_integer("scheme", 1);
  fmi2EnterInitializationMode(host.fmu);
  EXPECT_EQ(fmi2ExitInitializationMode(host.fmu), fmi2Error);
  EXPECT_TRUE(host.said({"no model exchange", "scheme = midpoint", "choose classical"}));
  host.set_integer("scheme", 2);
  EXPECT_EQ(fmi2ExitInitializationMode(host.fmu), fmi2OK);
}

TEST_F(Exchange, DirectionalDerivativesAreExactForLinearModels) {
  start();
  host.set("force", 0.7);
  EXPECT_DOUBLE_EQ(directional("der(velocity[1])", "position[1]"), -8.0);
  EXPECT_DOUBLE_EQ(directional("der(velocity[1])", "position[2]", 0.37), 0.37 * 4.0);
  EXPECT_DOUBLE_EQ(directional("der(velocity[2])", "force"), 1.0);
  EXPECT_EQ(directional("der(position[1])", "velocity[1]"), 1.0);
  EXPECT_DOUBLE_EQ(directional("reading", "bias"), 1.0);
  EXPECT_DOUBLE_EQ(directional("reading", "position[2]"), 1.0);
  EXPECT_EQ(directional("x", "force"), 0.0);
  EXPECT_EQ(directional("x", "force", 0.0), 0.0);
  EXPECT_EQ(directional("der(velocity[9])", "position[9]"), 0.0);
}

TEST_F(Exchange, DirectionalDerivativesLeaveNoTrace) {
  start();
  std::vector<double> x(kStates, 0.0);
  x[0] = 0.1;
  put(x);
  const double reading = host.get("reading");
  const auto dx = derivatives();
  directional("reading", "position[2]");
  EXPECT_EQ(states(), x);
  EXPECT_EQ(host.get("reading"), reading);
  EXPECT_EQ(derivatives(), dx);
  EXPECT_EQ(fmi2EnterEventMode(host.fmu), fmi2OK);
  host.set("breaking_force", 0.0);  // fails on one side only
  const auto u = reference("der(velocity[1])"), k = reference("force");
  const double seed = 1.0;
  double result = kNaN;
  EXPECT_EQ(fmi2GetDirectionalDerivative(host.fmu, &u, 1, &k, 1, &seed, &result), fmi2Discard);
  EXPECT_TRUE(host.said({"the chain is broken"}));
  EXPECT_EQ(host.get("force"), 0.0);
  EXPECT_EQ(states(), x);
}

TEST_F(Exchange, DirectionalDerivativesRefuseOtherDirections) {
  start();
  const double seed = 1.0;
  double result = 0.0;
  const auto refuse = [&](const char* unknown, const char* known) {
    const auto u = reference(unknown), k = reference(known);
    EXPECT_EQ(fmi2GetDirectionalDerivative(host.fmu, &u, 1, &k, 1, &seed, &result), fmi2Error) << unknown << known;
  };
  refuse("x", "mass");
  EXPECT_TRUE(host.said({"mass is not known here"}));
  refuse("x", "x");
  refuse("force", "position[1]");
  EXPECT_TRUE(host.said({"force is not an unknown here"}));
  refuse("position[1]", "force");
  refuse("builds", "force");
}

TEST(Initialization, HasDerivativesWithRespectToParametersAndInputs) {
  Host host;
  fmi2EnterInitializationMode(host.fmu);
  host.set("force", 0.6);
  const auto directional = [&](const char* unknown, const char* known) {
    const auto u = reference(unknown), k = reference(known);
    const double seed = 1.0;
    double result = kNaN;
    EXPECT_EQ(fmi2GetDirectionalDerivative(host.fmu, &u, 1, &k, 1, &seed, &result), fmi2OK) << host.last();
    return result;
  };
  EXPECT_DOUBLE_EQ(directional("position[1]", "bias"), 1.0);
  EXPECT_DOUBLE_EQ(directional("reading", "bias"), 2.0) << "the start position and the reading itself";
  EXPECT_NEAR(directional("der(velocity[1])", "mass"), -0.6, 1e-11);
  EXPECT_EQ(host.get("mass"), 1.0);
  host.set_boolean("is_clamped", 1);
  EXPECT_DOUBLE_EQ(directional("position[1]", "bias"), 0.0);
}

}  // namespace
}  // namespace probe
