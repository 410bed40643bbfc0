// Every function in every state of a slave, against the table of the standard (2.0.4, section 4.2.4).
#include <functional>

#include "probe/host.hpp"

namespace probe {
namespace {

enum State { instantiated, initialization, complete, failed, terminated, error };

constexpr double kDiscardedAt = 0.1;

void bring(Host& host, State state) {
  if (state == instantiated) return;
  fmi2EnterInitializationMode(host.fmu);
  if (state == initialization) return;
  fmi2ExitInitializationMode(host.fmu);
  if (state == complete) return;
  if (state == failed) {
    host.set("longest_step", kDiscardedAt);
    ASSERT_EQ(host.step(0.0, 0.2), fmi2Discard);
  } else if (state == terminated) {
    ASSERT_EQ(fmi2Terminate(host.fmu), fmi2OK);
  } else {
    host.set("breaking_force", 1.0);
    host.set("force", 2.0);
    ASSERT_EQ(host.step(0.0, 0.2), fmi2Error);
  }
}

struct Case {
  std::string name;
  std::string allowed;  // one letter per State
  std::function<fmi2Status(Host&)> call;
};

std::vector<Case> cases() {
  static const fmi2ValueReference x = reference("x"), force = reference("force"), builds = reference("builds"),
                                  clamped = reference("is_clamped");
  static double value[1] = {0.5};
  static int integer[1] = {0};
  static const int first[1] = {1};
  static fmi2Status status;
  const auto with_state = [](auto use) {
    return [use](Host& host) {
      fmi2FMUstate state = host.save();
      const fmi2Status result = use(host, state);
      fmi2FreeFMUstate(host.fmu, &state);
      return result;
    };
  };
  // Columns: instantiated, initialization, step complete, step failed, terminated, error. In step failed the setters
  // and fmi2DoStep go beyond the standard, since the state is valid at the last successful time.
  return {
      {"fmi2SetDebugLogging", "xxxxxx", [](Host& h) { return fmi2SetDebugLogging(h.fmu, fmi2True, 0, nullptr); }},
      {"fmi2SetupExperiment", "x.....", [](Host& h) { return fmi2SetupExperiment(h.fmu, 0, 0, 0, 0, 0); }},
      {"fmi2EnterInitializationMode", "x.....", [](Host& h) { return fmi2EnterInitializationMode(h.fmu); }},
      {"fmi2ExitInitializationMode", ".x....", [](Host& h) { return fmi2ExitInitializationMode(h.fmu); }},
      {"fmi2Terminate", "..xx..", [](Host& h) { return fmi2Terminate(h.fmu); }},
      {"fmi2Reset", "xxxxxx", [](Host& h) { return fmi2Reset(h.fmu); }},
      {"fmi2GetReal", ".xxxxx", [](Host& h) { return fmi2GetReal(h.fmu, &x, 1, value); }},
      {"fmi2GetInteger", ".xxxxx", [](Host& h) { return fmi2GetInteger(h.fmu, &builds, 1, integer); }},
      {"fmi2GetBoolean", ".xxxxx", [](Host& h) { return fmi2GetBoolean(h.fmu, &clamped, 1, integer); }},
      {"fmi2GetString", ".xxxxx", [](Host& h) { return fmi2GetString(h.fmu, nullptr, 0, nullptr); }},
      {"fmi2SetReal", "xxxx..", [](Host& h) { return fmi2SetReal(h.fmu, &force, 1, value); }},
      {"fmi2SetInteger", "xxxx..", [](Host& h) { return fmi2SetInteger(h.fmu, nullptr, 0, nullptr); }},
      {"fmi2SetBoolean", "xxxx..", [](Host& h) { return fmi2SetBoolean(h.fmu, nullptr, 0, nullptr); }},
      {"fmi2SetString", "xxxx..", [](Host& h) { return fmi2SetString(h.fmu, nullptr, 0, nullptr); }},
      {"fmi2SetRealInputDerivatives", "xxxx..",
       [](Host& h) { return fmi2SetRealInputDerivatives(h.fmu, &force, 1, first, value); }},
      {"fmi2GetRealOutputDerivatives", "..xxxx",
       [](Host& h) { return fmi2GetRealOutputDerivatives(h.fmu, &x, 1, first, value); }},
      {"fmi2GetFMUstate", "xxxxxx", with_state([](Host&, fmi2FMUstate) { return fmi2OK; })},
      {"fmi2SetFMUstate", "xxxxxx", with_state([](Host& h, fmi2FMUstate s) { return fmi2SetFMUstate(h.fmu, s); })},
      {"fmi2FreeFMUstate", "xxxxxx", with_state([](Host& h, fmi2FMUstate& s) { return fmi2FreeFMUstate(h.fmu, &s); })},
      {"fmi2SerializeFMUstate", "xxxxxx", [](Host& h) { return h.bytes().empty() ? fmi2Error : fmi2OK; }},
      {"fmi2DeSerializeFMUstate", "xxxxxx", [](Host& h) { return h.restore(h.bytes()); }},
      {"fmi2DoStep", "..xx..", [](Host& h) { return h.step(h.messages.empty() ? 0.0 : kDiscardedAt, 0.05); }},
      {"fmi2CancelStep", "......", [](Host& h) { return fmi2CancelStep(h.fmu); }},
      {"fmi2GetStatus", "..xxx.", [](Host& h) { return fmi2GetStatus(h.fmu, fmi2DoStepStatus, &status); }},
      {"fmi2GetRealStatus", "..xxx.", [](Host& h) { return fmi2GetRealStatus(h.fmu, fmi2LastSuccessfulTime, value); }},
      {"fmi2GetBooleanStatus", "..xxx.", [](Host& h) { return fmi2GetBooleanStatus(h.fmu, fmi2Terminated, integer); }},
      // Model exchange is not offered.
      {"fmi2EnterEventMode", "......", [](Host& h) { return fmi2EnterEventMode(h.fmu); }},
      {"fmi2NewDiscreteStates", "......", [](Host& h) { return fmi2NewDiscreteStates(h.fmu, nullptr); }},
      {"fmi2EnterContinuousTimeMode", "......", [](Host& h) { return fmi2EnterContinuousTimeMode(h.fmu); }},
      {"fmi2CompletedIntegratorStep", "......",
       [](Host& h) { return fmi2CompletedIntegratorStep(h.fmu, 0, nullptr, nullptr); }},
      {"fmi2SetTime", "......", [](Host& h) { return fmi2SetTime(h.fmu, 0.0); }},
      {"fmi2SetContinuousStates", "......", [](Host& h) { return fmi2SetContinuousStates(h.fmu, nullptr, 0); }},
      {"fmi2GetDerivatives", "......", [](Host& h) { return fmi2GetDerivatives(h.fmu, nullptr, 0); }},
      {"fmi2GetEventIndicators", "......", [](Host& h) { return fmi2GetEventIndicators(h.fmu, nullptr, 0); }},
      {"fmi2GetContinuousStates", "......", [](Host& h) { return fmi2GetContinuousStates(h.fmu, nullptr, 0); }},
      {"fmi2GetNominalsOfContinuousStates", "......",
       [](Host& h) { return fmi2GetNominalsOfContinuousStates(h.fmu, nullptr, 0); }},
  };
}

TEST(Calls, AreAllowedWhereTheStandardAllowsThem) {
  for (const Case& about : cases()) {
    for (int state = instantiated; state <= error; ++state) {
      Host host;
      bring(host, static_cast<State>(state));
      const std::size_t before = host.messages.size();
      const fmi2Status status = about.call(host);
      if (about.allowed[state] == 'x') {
        EXPECT_EQ(status, fmi2OK) << about.name << " in state " << state << ": " << host.last();
        continue;
      }
      EXPECT_EQ(status, fmi2Error) << about.name << " in state " << state;
      ASSERT_EQ(host.messages.size(), before + 1) << about.name << " in state " << state;
      EXPECT_EQ(host.messages.back().status, fmi2Error);
      EXPECT_EQ(host.messages.back().category, "logStatusError");
      EXPECT_TRUE(host.said({about.name, "not allowed in state"}));
    }
  }
}

TEST(Calls, OutOfOrderChangeNothing) {
  Host host;
  EXPECT_EQ(host.step(0.0, 0.1), fmi2Error);
  EXPECT_TRUE(host.said({"fmi2DoStep", "'instantiated'", "step complete"}));
  host.start();
  EXPECT_EQ(host.step(0.0, 0.1), fmi2OK);
}

TEST(Calls, WithoutAnInstanceFail) {
  EXPECT_EQ(fmi2DoStep(nullptr, 0.0, 0.1, fmi2False), fmi2Error);
  EXPECT_EQ(fmi2Reset(nullptr), fmi2Error);
  fmi2FreeInstance(nullptr);
}

TEST(Calls, WithNullArraysFail) {
  Host host;
  host.start();
  const auto vr = reference("x");
  EXPECT_EQ(fmi2GetReal(host.fmu, &vr, 1, nullptr), fmi2Error);
  EXPECT_TRUE(host.said({"null pointer"}));
  EXPECT_EQ(fmi2GetReal(host.fmu, nullptr, 1, nullptr), fmi2Error);
  EXPECT_EQ(fmi2GetReal(host.fmu, nullptr, 0, nullptr), fmi2OK);
  EXPECT_EQ(fmi2GetFMUstate(host.fmu, nullptr), fmi2Error);
}

TEST(Calls, OfWhatIsNotOfferedSaySo) {
  Host host;
  host.start();
  EXPECT_EQ(fmi2GetDirectionalDerivative(host.fmu, nullptr, 0, nullptr, 0, nullptr, nullptr), fmi2Error);
  EXPECT_TRUE(host.said({"providesDirectionalDerivative"}));
  const fmi2ValueReference vr = 0;
  fmi2String text = nullptr;
  EXPECT_EQ(fmi2GetString(host.fmu, &vr, 1, &text), fmi2Error);
  EXPECT_EQ(fmi2SetString(host.fmu, &vr, 1, &text), fmi2Error);
  EXPECT_TRUE(host.said({"no String variables"}));
}

TEST(Instantiate, RefusesWhatDoesNotFit) {
  const std::string guid = fmu::Blueprint::get().guid;
  Host host;
  const auto instantiate = [&](const char* name, fmi2Type type, const char* id) {
    return fmi2Instantiate(name, type, id, nullptr, &host.callbacks, fmi2False, fmi2False);
  };
  EXPECT_EQ(instantiate("a", fmi2CoSimulation, "{of another build}"), nullptr);
  EXPECT_TRUE(host.said({"{of another build}", guid, "build the FMU again"}));
  EXPECT_EQ(instantiate("a", fmi2CoSimulation, nullptr), nullptr);
  EXPECT_EQ(instantiate("", fmi2CoSimulation, guid.c_str()), nullptr);
  EXPECT_TRUE(host.said({"name"}));
  EXPECT_EQ(instantiate(nullptr, fmi2CoSimulation, guid.c_str()), nullptr);
  EXPECT_EQ(instantiate("a", fmi2ModelExchange, guid.c_str()), nullptr);
  EXPECT_TRUE(host.said({"co-simulation"}));
}

TEST(Instantiate, WorksWithoutCallbacks) {
  const std::string guid = fmu::Blueprint::get().guid;
  fmi2CallbackFunctions nothing{};
  for (const fmi2CallbackFunctions* functions :
       {static_cast<const fmi2CallbackFunctions*>(nullptr), &std::as_const(nothing)}) {
    const fmi2Component fmu =
        fmi2Instantiate("a", fmi2CoSimulation, guid.c_str(), nullptr, functions, fmi2False, fmi2True);
    ASSERT_NE(fmu, nullptr);
    EXPECT_EQ(fmi2DoStep(fmu, 0.0, 0.1, fmi2False), fmi2Error);
    fmi2FreeInstance(fmu);
  }
}

TEST(Inquiry, NamesTheStandard) {
  EXPECT_STREQ(fmi2GetVersion(), "2.0");
  EXPECT_STREQ(fmi2GetTypesPlatform(), "default");
}

}  // namespace
}  // namespace probe
