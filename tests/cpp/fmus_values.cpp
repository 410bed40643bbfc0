// Getting, setting, refusing, and when the model is built and evaluated.
#include "probe/data.hpp"
#include "probe/host.hpp"

namespace probe {
namespace {

TEST(Set, RefusesNaNInfinityAndOutOfRangeNamingAll) {
  Host host;
  for (const double bad : {kNaN, kInfinity, -kInfinity, 0.05, 10.5}) {
    EXPECT_EQ(host.set("mass", bad), fmi2Error);
    EXPECT_TRUE(host.said({"fmi2SetReal", "mass", "0.1 kg to 10 kg", "nothing was changed"}));
  }
  EXPECT_EQ(host.set("mass", 0.05), fmi2Error);
  EXPECT_TRUE(host.said({"mass = 0.05 kg refused"}));
  EXPECT_EQ(host.set("bias", kInfinity), fmi2Error);
  EXPECT_TRUE(host.said({"bias", "any finite value"}));
  EXPECT_EQ(host.set_integer("scheme", 3), fmi2Error);
  EXPECT_TRUE(host.said({"scheme = 3", "1 (midpoint), 2 (classical)"}));
  EXPECT_EQ(host.set_integer("masses", 0), fmi2Error);
  EXPECT_EQ(host.set_boolean("is_clamped", 2), fmi2Error);
  fmi2EnterInitializationMode(host.fmu);
  EXPECT_EQ(host.get("mass"), 1.0);
  EXPECT_EQ(host.get_integer("scheme"), 2);
}

TEST(Set, WritesAllOrNothing) {
  Host host;
  const fmi2ValueReference vr[] = {reference("mass"), reference("stiffness")};
  const double values[] = {2.0, kNaN};
  EXPECT_EQ(fmi2SetReal(host.fmu, vr, 2, values), fmi2Error);
  fmi2EnterInitializationMode(host.fmu);
  EXPECT_EQ(host.get("mass"), 1.0);
}

TEST(Set, RefusesOutputsUnknownReferencesAndOtherTypes) {
  Host host;
  host.start();
  EXPECT_EQ(host.set("x", 1.0), fmi2Error);
  EXPECT_TRUE(host.said({"x is an output"}));
  const fmi2ValueReference unknown = 999;
  double value = 0.0;
  EXPECT_EQ(fmi2SetReal(host.fmu, &unknown, 1, &value), fmi2Error);
  EXPECT_TRUE(host.said({"999", "0 to"}));
  EXPECT_EQ(fmi2GetReal(host.fmu, &unknown, 1, &value), fmi2Error);
  const auto masses = reference("masses");
  EXPECT_EQ(fmi2GetReal(host.fmu, &masses, 1, &value), fmi2Error);
  EXPECT_TRUE(host.said({"masses", "Integer"}));
  EXPECT_EQ(host.set_integer("mass", 1), fmi2Error);
  EXPECT_EQ(host.set_boolean("masses", 1), fmi2Error);
}

TEST(Set, TakesFixedParametersOnlyUntilInitialisationEnds) {
  Host host;
  EXPECT_EQ(host.set("mass", 2.0), fmi2OK);
  fmi2EnterInitializationMode(host.fmu);
  EXPECT_EQ(host.set("stiffness", 3.0), fmi2OK);
  fmi2ExitInitializationMode(host.fmu);
  EXPECT_EQ(host.set("mass", 3.0), fmi2Error);
  EXPECT_TRUE(host.said({"mass", "fixed parameter", "reset"}));
  EXPECT_EQ(host.get("mass"), 2.0);
  EXPECT_EQ(host.set("tolerance", 1e-4), fmi2OK);
  EXPECT_EQ(host.set("force", 1.0), fmi2OK);
}

TEST(Get, ReadsBackEveryStartValueOfTheTable) {
  Host host;
  fmi2EnterInitializationMode(host.fmu);
  for (const auto& row : fmu::Blueprint::get().rows) {
    if (row.causality == fmu::Causality::output) continue;
    switch (row.type) {
      case fmu::Type::real:
        EXPECT_EQ(host.get(row.name), row.start) << row.name;
        break;
      case fmu::Type::boolean: {
        const auto vr = reference(row.name);
        int value = -1;
        EXPECT_EQ(fmi2GetBoolean(host.fmu, &vr, 1, &value), fmi2OK);
        EXPECT_EQ(value, row.start);
        break;
      }
      default:
        EXPECT_EQ(host.get_integer(row.name), row.start) << row.name;
    }
  }
}

TEST(Outputs, FollowInputsSetWithoutAStep) {
  Host host;
  host.start();
  host.set("bias", 0.25);
  EXPECT_EQ(host.get("reading"), host.get("x") + 0.25);
  host.set("bias", -1.0);
  EXPECT_EQ(host.get("reading"), host.get("x") - 1.0);
}

TEST(Initialisation, IsDoneWhenOutputsAreReadAndRedoneAfterChanges) {
  Host host;
  fmi2EnterInitializationMode(host.fmu);
  host.set("bias", 0.5);
  EXPECT_EQ(host.get("x"), 0.5);
  host.set("bias", 0.75);
  EXPECT_EQ(host.get("x"), 0.75);
  host.set_boolean("is_clamped", fmi2True);
  EXPECT_EQ(host.get("x"), 0.0);
  fmi2ExitInitializationMode(host.fmu);
  host.set("bias", 2.0);
  EXPECT_EQ(host.get("x"), 0.0);
}

TEST(Build, RunsOnceUnlessParametersChange) {
  Host host;
  fmi2EnterInitializationMode(host.fmu);
  EXPECT_EQ(host.get_integer("builds"), 1);
  host.set("force", 1.0);
  host.set("mass", 1.0);  // as it was
  EXPECT_EQ(host.get_integer("builds"), 1);
  host.set("mass", 2.0);
  EXPECT_EQ(host.get_integer("builds"), 2);
  fmi2ExitInitializationMode(host.fmu);
  host.set("tolerance", 1e-3);
  EXPECT_EQ(host.get_integer("builds"), 2);
}

TEST(Build, ThatFailsLeavesTheInstanceToBeRepaired) {
  Host host;
  host.set("damping", 11.0);
  fmi2EnterInitializationMode(host.fmu);
  EXPECT_EQ(fmi2ExitInitializationMode(host.fmu), fmi2Error);
  EXPECT_TRUE(host.said({"fmi2ExitInitializationMode", "damping is above 10 times the mass"}));
  EXPECT_EQ(host.get("damping"), 11.0);
  host.set("damping", 9.0);
  EXPECT_EQ(fmi2ExitInitializationMode(host.fmu), fmi2OK);
  EXPECT_EQ(host.step(0.0, 0.1), fmi2OK);
}

TEST(Experiment, SetsTimeStopAndTolerance) {
  Host host;
  EXPECT_EQ(fmi2SetupExperiment(host.fmu, fmi2True, 1e-3, 5.0, fmi2True, 5.25), fmi2OK);
  host.start();
  EXPECT_EQ(host.get("tolerance"), 1e-3);
  EXPECT_EQ(host.step(5.0, 0.2), fmi2OK);
  EXPECT_EQ(host.step(5.2, 0.2), fmi2Error);
  EXPECT_TRUE(host.said({"stop time 5.25 s"}));
  EXPECT_EQ(host.step(5.2, 0.05), fmi2OK);
}

TEST(Experiment, TakesTheNearestToleranceThatIsAllowed) {
  for (const auto& [asked, used] : {std::pair{1e-14, 1e-12}, std::pair{1.0, 1e-2}, std::pair{1e-4, 1e-4}}) {
    Host host(true);
    EXPECT_EQ(fmi2SetupExperiment(host.fmu, fmi2True, asked, 0.0, fmi2False, 0.0), fmi2OK);
    EXPECT_TRUE(asked == used || host.said({"tolerance", "nearest"}));
    host.start();
    EXPECT_EQ(host.get("tolerance"), used);
  }
}

TEST(Experiment, LeavesAToleranceThatTheHostSetItself) {
  Host host(true), later;
  host.set("tolerance", 1e-3);
  EXPECT_EQ(fmi2SetupExperiment(host.fmu, fmi2True, 1e-5, 0.0, fmi2False, 0.0), fmi2OK);
  EXPECT_TRUE(host.said({"1e-05", "not used", "0.001"}));
  ASSERT_EQ(later.restore(host.bytes()), fmi2OK);
  EXPECT_EQ(fmi2SetupExperiment(later.fmu, fmi2True, 1e-5, 0.0, fmi2False, 0.0), fmi2OK);
  for (Host* each : {&host, &later}) {
    each->start();
    EXPECT_EQ(each->get("tolerance"), 1e-3);
  }
  EXPECT_EQ(fmi2Reset(host.fmu), fmi2OK);
  EXPECT_EQ(fmi2SetupExperiment(host.fmu, fmi2True, 1e-5, 0.0, fmi2False, 0.0), fmi2OK);
  host.start();
  EXPECT_EQ(host.get("tolerance"), 1e-5) << "after a reset nothing is set";
}

TEST(Outputs, ThatNoModelWritesCannotBeRead) {
  Host host;
  forgets_reading = true;
  host.start();
  const auto reading = reference("reading");
  double value = 0.0;
  for (const char* when : {"at the start", "after a step"}) {
    EXPECT_EQ(fmi2GetReal(host.fmu, &reading, 1, &value), fmi2Error) << when;
    EXPECT_TRUE(host.said({"reading is not calculated with these parameters", "fault of probe.fmu"})) << when;
    EXPECT_EQ(value, 0.0) << when;
    EXPECT_EQ(host.get("x"), 0.0) << "others are read as before, " << when;
    EXPECT_EQ(host.step(when == std::string("at the start") ? 0.0 : 0.1, 0.1), fmi2OK);
  }
  forgets_reading = false;
  EXPECT_EQ(host.get("reading"), 0.0);
  forgets_reading = true;
  EXPECT_EQ(fmi2Reset(host.fmu), fmi2OK);
  host.start();
  EXPECT_EQ(fmi2GetReal(host.fmu, &reading, 1, &value), fmi2Error) << "what another run wrote does not count";
  forgets_reading = false;
}

TEST(Experiment, RefusesTimesThatAreNone) {
  Host host;
  EXPECT_EQ(fmi2SetupExperiment(host.fmu, fmi2False, 0.0, kNaN, fmi2False, 0.0), fmi2Error);
  EXPECT_EQ(fmi2SetupExperiment(host.fmu, fmi2False, 0.0, 1.0, fmi2True, 0.5), fmi2Error);
  for (const double tolerance : {0.0, -1e-3, kNaN, kInfinity})
    EXPECT_EQ(fmi2SetupExperiment(host.fmu, fmi2True, tolerance, 0.0, fmi2False, 0.0), fmi2Error);
  EXPECT_TRUE(host.said({"tolerance inf", "finite one above 0"}));
}

TEST(Log, CategoriesAreSwitchedOnAndOff) {
  Host host;
  const auto refuse = [&] { return host.set("mass", kNaN); };
  const auto count = [&](auto call) {
    host.messages.clear();
    call();
    return host.messages.size();
  };
  const auto restart = [&] {
    fmi2Reset(host.fmu);
    host.start();
  };
  EXPECT_EQ(count(refuse), 1u);
  EXPECT_EQ(count(restart), 0u);
  const fmi2String errors[] = {"logStatusError"}, all[] = {"logAll"}, unknown[] = {"logWeather"};
  EXPECT_EQ(fmi2SetDebugLogging(host.fmu, fmi2False, 1, errors), fmi2OK);
  EXPECT_EQ(count(refuse), 0u);
  EXPECT_EQ(fmi2SetDebugLogging(host.fmu, fmi2True, 1, all), fmi2OK);
  EXPECT_EQ(count(refuse), 1u);
  EXPECT_GT(count(restart), 0u);
  EXPECT_EQ(host.messages[0].category, "logEvents");
  EXPECT_EQ(fmi2SetDebugLogging(host.fmu, fmi2True, 1, unknown), fmi2Error);
  EXPECT_TRUE(host.said({"logWeather", "logStatusError"}));
  EXPECT_EQ(fmi2SetDebugLogging(host.fmu, fmi2False, 0, nullptr), fmi2OK);
  EXPECT_EQ(count(refuse), 0u);
}

TEST(Log, PassesWarningsOnWithPercentAndHashDoubled) {
  Host host;
  host.start();
  host.set("force", -2.0);
  EXPECT_EQ(host.step(0.0, 0.1), fmi2Warning);
  ASSERT_EQ(host.messages.size(), 1u);
  EXPECT_EQ(host.messages[0].category, "logStatusWarning");
  EXPECT_EQ(host.last(), "the force pulls by 100 %% and ##more");
  EXPECT_EQ(host.step(0.1, 0.1), fmi2Warning);
  host.set("force", 0.0);
  EXPECT_EQ(host.step(0.2, 0.1), fmi2OK);
}

}  // namespace
}  // namespace probe
