// What one FMI call costs beyond the model, in nanoseconds: the fastest of several repeats, a trivial probe behind it.
#include <chrono>
#include <cstdio>
#include <functional>
#include <limits>

#include "description/blueprint.hpp"
#include "fmi2Functions.h"

namespace {

void report(const char* what, const std::function<void()>& call) {
  constexpr int kCalls = 20000, kRepeats = 15;
  double best = std::numeric_limits<double>::infinity();
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < kCalls; ++i) call();
    const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - start;
    best = std::min(best, taken.count() / kCalls);
  }
  std::printf("%-52s %8.1f ns\n", what, best);
}

}  // namespace

int main() {
  const auto& rows = fmu::Blueprint::get().rows;
  const auto reference = [&](const char* name) {
    unsigned i = 0;
    while (rows[i].name != name) ++i;
    return i;
  };
  const fmi2Component fmu = fmi2Instantiate("bench", fmi2CoSimulation, fmu::Blueprint::get().guid.c_str(), nullptr,
                                            nullptr, fmi2False, fmi2False);
  fmi2EnterInitializationMode(fmu);
  fmi2ExitInitializationMode(fmu);
  const unsigned inputs[] = {reference("force"), reference("bias"), reference("force")};
  const unsigned outputs[] = {reference("x"), reference("v"), reference("reading")};
  const int orders[] = {1, 1, 1};
  double values[] = {0.1, 0.2, 0.3};

  report("fmi2SetReal, 3 inputs", [&] { fmi2SetReal(fmu, inputs, 3, values); });
  report("fmi2SetRealInputDerivatives, 3 inputs", [&] { fmi2SetRealInputDerivatives(fmu, inputs, 3, orders, values); });
  report("fmi2GetReal, 3 outputs, nothing changed", [&] { fmi2GetReal(fmu, outputs, 3, values); });
  report("fmi2SetReal + fmi2GetReal, evaluated anew", [&] {
    fmi2SetReal(fmu, inputs, 3, values);
    fmi2GetReal(fmu, outputs, 3, values);
  });
  fmi2FMUstate state = nullptr;
  fmi2GetFMUstate(fmu, &state);
  report("fmi2GetFMUstate into the same handle", [&] { fmi2GetFMUstate(fmu, &state); });
  report("fmi2SetFMUstate", [&] { fmi2SetFMUstate(fmu, state); });
  report("fmi2GetFMUstate + fmi2FreeFMUstate, new handle", [&] {
    fmi2FMUstate fresh = nullptr;
    fmi2GetFMUstate(fmu, &fresh);
    fmi2FreeFMUstate(fmu, &fresh);
  });

  const auto model = fmu::make_model({});
  if (!model->build().is_ok() || !model->initialise(0.0).is_ok()) {
    std::fputs("the probe does not start\n", stderr);
    return 1;
  }
  double t = 0.0;
  report("Model::step of the probe alone", [&] { model->step(t, 1e-3), t += 1e-3; });
  t = 0.0;
  report("fmi2DoStep of the probe", [&] { fmi2DoStep(fmu, t, 1e-3, fmi2True), t += 1e-3; });
  fmi2FreeInstance(fmu);
}
