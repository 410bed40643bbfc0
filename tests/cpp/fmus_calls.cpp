// Every function in every state of both interfaces, against the tables of the standard (2.0.4, sections 3.2.3 and
// 4.2.4).
#include <functional>

#include "probe/host.hpp"

namespace probe {
namespace {

enum State { instantiated, initialization, complete, failed, terminated, error, event, continuous, ended };

constexpr double kDiscardedAt = 0.1;

void bring(Host& host, State state) {
  if (state == instantiated) return;
  fmi2EnterInitializationMode(host.fmu);
  if (state == initialization) return;
  fmi2ExitInitializationMode(host.fmu);
  if (state == complete || state == event) return;
  if (state == failed) {
    host.set("longest_step", kDiscardedAt);
    ASSERT_EQ(host.step(0.0, 0.2), fmi2Discard);
  } else if (state == continuous) {
    ASSERT_EQ(fmi2EnterContinuousTimeMode(host.fmu), fmi2OK);
  } else if (state == terminated || state == ended) {
    ASSERT_EQ(fmi2Terminate(host.fmu), fmi2OK);
  } else {
    host.set("breaking_force", 1.0);
    host.set("force", 2.0);
    ASSERT_EQ(host.step(0.0, 0.2), fmi2Error);
  }
}

struct Case {
  std::string name;
  std::string slave;     // one letter per State: instantiated, initialization, complete, failed, terminated, error
  std::string exchange;  // instantiated, initialization, event, continuous, ended
  std::function<fmi2Status(Host&)> call;
};

std::vector<Case> cases() {
  static const fmi2ValueReference x = reference("x"), force = reference("force"), builds = reference("builds"),
                                  clamped = reference("is_clamped");
  static double value[2] = {0.5, 0.0};
  static int integer[1] = {0};
  static const int first[1] = {1};
  static fmi2Status status;
  static fmi2EventInfo info;
  static std::vector<double> states(fmu::Blueprint::get().states.size());
  const auto with_state = [](auto use) {
    return [use](Host& host) {
      fmi2FMUstate state = host.save();
      const fmi2Status result = use(host, state);
      fmi2FreeFMUstate(host.fmu, &state);
      return result;
    };
  };
  // In step failed the setters and fmi2DoStep go beyond the standard, since the state is valid at the last successful
  // time.
  return {
      {"fmi2SetDebugLogging", "xxxxxx", "xxxxx",
       [](Host& h) { return fmi2SetDebugLogging(h.fmu, fmi2True, 0, nullptr); }},
      {"fmi2SetupExperiment", "x.....", "x....", [](Host& h) { return fmi2SetupExperiment(h.fmu, 0, 0, 0, 0, 0); }},
      {"fmi2EnterInitializationMode", "x.....", "x....", [](Host& h) { return fmi2EnterInitializationMode(h.fmu); }},
      {"fmi2ExitInitializationMode", ".x....", ".x...", [](Host& h) { return fmi2ExitInitializationMode(h.fmu); }},
      {"fmi2Terminate", "..xx..", "..xx.", [](Host& h) { return fmi2Terminate(h.fmu); }},
      {"fmi2Reset", "xxxxxx", "xxxxx", [](Host& h) { return fmi2Reset(h.fmu); }},
      {"fmi2GetReal", ".xxxxx", ".xxxx", [](Host& h) { return fmi2GetReal(h.fmu, &x, 1, value); }},
      {"fmi2GetInteger", ".xxxxx", ".xxxx", [](Host& h) { return fmi2GetInteger(h.fmu, &builds, 1, integer); }},
      {"fmi2GetBoolean", ".xxxxx", ".xxxx", [](Host& h) { return fmi2GetBoolean(h.fmu, &clamped, 1, integer); }},
      {"fmi2GetString", ".xxxxx", ".xxxx", [](Host& h) { return fmi2GetString(h.fmu, nullptr, 0, nullptr); }},
      {"fmi2SetReal", "xxxx..", "xxxx.", [](Host& h) { return fmi2SetReal(h.fmu, &force, 1, value); }},
      {"fmi2SetInteger", "xxxx..", "xxx..", [](Host& h) { return fmi2SetInteger(h.fmu, nullptr, 0, nullptr); }},
      {"fmi2SetBoolean", "xxxx..", "xxx..", [](Host& h) { return fmi2SetBoolean(h.fmu, nullptr, 0, nullptr); }},
      {"fmi2SetString", "xxxx..", "xxx..", [](Host& h) { return fmi2SetString(h.fmu, nullptr, 0, nullptr); }},
      {"fmi2SetRealInputDerivatives", "xxxx..", ".....",
       [](Host& h) { return fmi2SetRealInputDerivatives(h.fmu, &force, 1, first, value); }},
      {"fmi2GetRealOutputDerivatives", "..xxxx", ".....",
       [](Host& h) { return fmi2GetRealOutputDerivatives(h.fmu, &x, 1, first, value); }},
      {"fmi2GetDirectionalDerivative", ".xxxxx", ".xxxx",
       [](Host& h) { return fmi2GetDirectionalDerivative(h.fmu, &x, 1, &force, 1, value, value + 1); }},
      {"fmi2GetFMUstate", "xxxxxx", "xxxxx", with_state([](Host&, fmi2FMUstate) { return fmi2OK; })},
      {"fmi2SetFMUstate", "xxxxxx", "xxxxx",
       with_state([](Host& h, fmi2FMUstate s) { return fmi2SetFMUstate(h.fmu, s); })},
      {"fmi2FreeFMUstate", "xxxxxx", "xxxxx",
       with_state([](Host& h, fmi2FMUstate& s) { return fmi2FreeFMUstate(h.fmu, &s); })},
      {"fmi2SerializeFMUstate", "xxxxxx", "xxxxx", [](Host& h) { return h.bytes().empty() ? fmi2Error : fmi2OK; }},
      {"fmi2DeSerializeFMUstate", "xxxxxx", "xxxxx", [](Host& h) { return h.restore(h.bytes()); }},
      {"fmi2DoStep", "..xx..", ".....", [](Host& h) { return h.step(h.messages.empty() ? 0.0 : kDiscardedAt, 0.05); }},
      {"fmi2CancelStep", "......", ".....", [](Host& h) { return fmi2CancelStep(h.fmu); }},
      {"fmi2GetStatus", "..xxx.", ".....", [](Host& h) { return fmi2GetStatus(h.fmu, fmi2DoStepStatus, &status); }},
      {"fmi2GetRealStatus", "..xxx.", ".....",
       [](Host& h) { return fmi2GetRealStatus(h.fmu, fmi2LastSuccessfulTime, value); }},
      {"fmi2GetBooleanStatus", "..xxx.", ".....",
       [](Host& h) { return fmi2GetBooleanStatus(h.fmu, fmi2Terminated, integer); }},
      {"fmi2EnterEventMode", "......", "..xx.", [](Host& h) { return fmi2EnterEventMode(h.fmu); }},
      {"fmi2NewDiscreteStates", "......", "..x..", [](Host& h) { return fmi2NewDiscreteStates(h.fmu, &info); }},
      {"fmi2EnterContinuousTimeMode", "......", "..x..", [](Host& h) { return fmi2EnterContinuousTimeMode(h.fmu); }},
      {"fmi2CompletedIntegratorStep", "......", "...x.",
       [](Host& h) { return fmi2CompletedIntegratorStep(h.fmu, 0, integer, integer); }},
      {"fmi2SetTime", "......", "..xx.", [](Host& h) { return fmi2SetTime(h.fmu, 0.0); }},
      {"fmi2SetContinuousStates", "......", "...x.",
       [](Host& h) { return fmi2SetContinuousStates(h.fmu, states.data(), states.size()); }},
      {"fmi2GetDerivatives", "......", ".xxxx",
       [](Host& h) { return fmi2GetDerivatives(h.fmu, states.data(), states.size()); }},
      {"fmi2GetEventIndicators", "......", ".xxxx", [](Host& h) { return fmi2GetEventIndicators(h.fmu, nullptr, 0); }},
      {"fmi2GetContinuousStates", "......", ".xxxx",
       [](Host& h) { return fmi2GetContinuousStates(h.fmu, states.data(), states.size()); }},
      {"fmi2GetNominalsOfContinuousStates", "......", "xxxxx",
       [](Host& h) { return fmi2GetNominalsOfContinuousStates(h.fmu, states.data(), states.size()); }},
  };
}

void try_all(fmi2Type type, const std::vector<State>& states, std::string Case::*allowed) {
  for (const Case& entry : cases()) {
    for (std::size_t i = 0; i < states.size(); ++i) {
      Host host(false, type);
      bring(host, states[i]);
      const std::size_t before = host.messages.size();
      const fmi2Status status = entry.call(host);
      if ((entry.*allowed)[i] == 'x') {
        EXPECT_EQ(status, fmi2OK) << entry.name << " in state " << i << ": " << host.last();
        continue;
      }
      EXPECT_EQ(status, fmi2Error) << entry.name << " in state " << i;
      ASSERT_EQ(host.messages.size(), before + 1) << entry.name << " in state " << i;
      EXPECT_EQ(host.messages.back().status, fmi2Error);
      EXPECT_EQ(host.messages.back().category, "logStatusError");
      EXPECT_TRUE(host.said({entry.name, "not allowed in state"}));
    }
  }
}

TEST(Calls, AreAllowedWhereTheStandardAllowsThemInCoSimulation) {
  try_all(fmi2CoSimulation, {instantiated, initialization, complete, failed, terminated, error}, &Case::slave);
}

TEST(Calls, AreAllowedWhereTheStandardAllowsThemInModelExchange) {
  try_all(fmi2ModelExchange, {instantiated, initialization, event, continuous, ended}, &Case::exchange);
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
