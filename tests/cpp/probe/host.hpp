// A host for the probe in the same process: one instance, its log, and short names for the calls that tests make.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "description/blueprint.hpp"
#include "fmi2Functions.h"

namespace probe {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline fmi2ValueReference reference(const std::string& name) {
  const auto& rows = fmu::Blueprint::get().rows;
  const auto row = std::ranges::find(rows, name, &fmu::Variable::name);
  EXPECT_NE(row, rows.end()) << name;
  return static_cast<fmi2ValueReference>(row - rows.begin());
}

struct Message {
  fmi2Status status;
  std::string category;
  std::string text;
};

class Host {
 public:
  explicit Host(bool debug = false, fmi2Type type = fmi2CoSimulation) {
    callbacks.logger = take;
    callbacks.componentEnvironment = this;
    fmu = fmi2Instantiate("probe", type, fmu::Blueprint::get().guid.c_str(), nullptr, &callbacks, fmi2False, fmi2True);
    EXPECT_NE(fmu, nullptr);
    const fmi2String events = "logEvents";
    if (debug) return;
    EXPECT_EQ(fmi2SetDebugLogging(fmu, fmi2False, 1, &events), fmi2OK);
  }
  Host(const Host&) = delete;
  ~Host() { fmi2FreeInstance(fmu); }

  void start() {
    EXPECT_EQ(fmi2EnterInitializationMode(fmu), fmi2OK);
    EXPECT_EQ(fmi2ExitInitializationMode(fmu), fmi2OK);
  }

  fmi2Status set(const std::string& name, double value) {
    const auto vr = reference(name);
    return fmi2SetReal(fmu, &vr, 1, &value);
  }
  fmi2Status set_integer(const std::string& name, int value) {
    const auto vr = reference(name);
    return fmi2SetInteger(fmu, &vr, 1, &value);
  }
  fmi2Status set_boolean(const std::string& name, int value) {
    const auto vr = reference(name);
    return fmi2SetBoolean(fmu, &vr, 1, &value);
  }
  fmi2Status set_derivative(const std::string& name, int order, double value) {
    const auto vr = reference(name);
    return fmi2SetRealInputDerivatives(fmu, &vr, 1, &order, &value);
  }
  double get(const std::string& name) {
    const auto vr = reference(name);
    double value = kNaN;
    EXPECT_EQ(fmi2GetReal(fmu, &vr, 1, &value), fmi2OK) << name << ": " << last();
    return value;
  }
  int get_integer(const std::string& name) {
    const auto vr = reference(name);
    int value = -1;
    EXPECT_EQ(fmi2GetInteger(fmu, &vr, 1, &value), fmi2OK) << name << ": " << last();
    return value;
  }
  fmi2Status step(double t, double h) { return fmi2DoStep(fmu, t, h, fmi2False); }

  fmi2FMUstate save() {
    fmi2FMUstate state = nullptr;
    EXPECT_EQ(fmi2GetFMUstate(fmu, &state), fmi2OK) << last();
    return state;
  }
  fmi2Status restore(fmi2FMUstate state) { return fmi2SetFMUstate(fmu, state); }
  std::vector<char> bytes() {
    fmi2FMUstate state = save();
    size_t size = 0;
    EXPECT_EQ(fmi2SerializedFMUstateSize(fmu, state, &size), fmi2OK);
    std::vector<char> result(size);
    EXPECT_EQ(fmi2SerializeFMUstate(fmu, state, result.data(), size), fmi2OK) << last();
    EXPECT_EQ(fmi2FreeFMUstate(fmu, &state), fmi2OK);
    return result;
  }
  fmi2Status restore(const std::vector<char>& bytes) {
    fmi2FMUstate state = nullptr;
    const fmi2Status status = fmi2DeSerializeFMUstate(fmu, bytes.data(), bytes.size(), &state);
    return status == fmi2OK ? restore(state) : status;
  }

  std::string last() const { return messages.empty() ? "" : messages.back().text; }
  /// The last message contains every one of the words.
  testing::AssertionResult said(std::initializer_list<std::string> words) const {
    for (const std::string& word : words)
      if (last().find(word) == std::string::npos)
        return testing::AssertionFailure() << "'" << word << "' is not in: " << last();
    return testing::AssertionSuccess();
  }

  static void take(fmi2ComponentEnvironment environment, fmi2String, fmi2Status status, fmi2String category,
                   fmi2String text, ...) {
    static_cast<Host*>(environment)->messages.push_back({status, category, text});
  }

  std::vector<Message> messages;
  fmi2CallbackFunctions callbacks{};
  fmi2Component fmu = nullptr;
};

}  // namespace probe
