// cycle BINARY modelDescription.xml COUNT: COUNT times instantiates an FMU, initialises it, takes a step, saves and
// restores a state, and frees it: co-simulation and model exchange in turn. Exit code 1 if a call fails, or if the
// memory in use grows from cycle to cycle; valgrind or a sanitizer tells where it is lost.
#include <malloc.h>

#include <cstdio>
#include <cstdlib>

#include "library.hpp"

namespace {

constexpr long kWarmUp = 10;            // cycles until caches are filled
constexpr std::size_t kGrowth = 65536;  // memory in use may differ by this between two cycles [bytes]

void ignore(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...) {}

void expect(bool holds, const char* what) {
  if (!holds) throw std::runtime_error(std::string("unexpected: ") + what);
}

void save_and_restore(const host::Library& fmu, fmi2Component instance) {
  fmi2FMUstate state = nullptr;
  expect(fmu.GetFMUstate(instance, &state) == fmi2OK, "no state");
  expect(fmu.SetFMUstate(instance, state) == fmi2OK, "no way back");
  expect(fmu.FreeFMUstate(instance, &state) == fmi2OK, "a state stays");
}

void cycle(const host::Library& fmu, const host::Description& description, fmi2Type type) {
  const fmi2CallbackFunctions callbacks{ignore, std::calloc, std::free, nullptr, nullptr};
  const fmi2Component instance =
      fmu.Instantiate("cycle", type, description.guid.c_str(), "", &callbacks, fmi2False, fmi2False);
  expect(instance, "no instance");
  expect(fmu.EnterInitializationMode(instance) == fmi2OK, "no initialisation");
  expect(fmu.ExitInitializationMode(instance) <= fmi2Warning, "initialisation fails");
  if (type == fmi2CoSimulation) {
    expect(fmu.DoStep(instance, 0.0, 0.01, fmi2True) <= fmi2Warning, "a step fails");
  } else {
    std::vector<double> rates(description.states.size());
    expect(fmu.EnterContinuousTimeMode(instance) == fmi2OK, "no continuous time");
    expect(fmu.GetDerivatives(instance, rates.data(), rates.size()) == fmi2OK, "no derivatives");
  }
  save_and_restore(fmu, instance);
  fmu.FreeInstance(instance);
}

}  // namespace

int main(int count, char** arguments) try {
  expect(count == 4, "arguments; usage: cycle BINARY modelDescription.xml COUNT");
  const host::Library fmu(arguments[1]);
  const host::Description description(arguments[2]);
  const long cycles = std::stol(arguments[3]);
  std::size_t used = 0;
  for (long k = 0; k < cycles; ++k) {
    cycle(fmu, description, k % 2 == 0 ? fmi2CoSimulation : fmi2ModelExchange);
    if (k == kWarmUp) used = mallinfo2().uordblks;
  }
  const std::size_t last = mallinfo2().uordblks;
  std::printf("%ld cycles: %zu bytes in use after %ld, %zu at the end\n", cycles, used, kWarmUp, last);
  expect(cycles <= kWarmUp || last <= used + kGrowth, "the memory in use grows");
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
