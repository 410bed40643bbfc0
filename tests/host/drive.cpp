// drive BINARY modelDescription.xml STEP [VR=VALUE ...]: loads an FMU as any host does and runs a short co-simulation
// and a short model exchange with all that allocates: saved, restored, serialised and leaked states, directional
// derivatives, refused calls. Under valgrind it shows that nothing leaks.
#include <dlfcn.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "fmi2FunctionTypes.h"

namespace {

void quiet(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...) {}

void expect(bool holds, const char* what) {
  if (!holds) throw std::runtime_error(std::string("unexpected: ") + what);
}

struct Description {
  explicit Description(const char* path) {
    std::ifstream file(path);
    const std::string xml{std::istreambuf_iterator<char>(file), {}};
    const auto start = xml.find("guid=\"");
    expect(start != std::string::npos, "no guid in the description");
    guid = xml.substr(start + 6, xml.find('"', start + 6) - start - 6);
    for (auto at = xml.find(" derivative=\""); at != std::string::npos; at = xml.find(" derivative=\"", at + 1))
      ++states;
    for (auto at = xml.find("<ScalarVariable"); at != std::string::npos; at = xml.find("<ScalarVariable", at + 1))
      ++variables;
  }
  std::string guid;
  std::size_t states = 0, variables = 0;
};

struct Functions {
  explicit Functions(void* library) : library_(library) {}

 private:
  void* library_;
  void* find(const char* name) const {
    void* symbol = dlsym(library_, name);
    expect(symbol, name);
    return symbol;
  }

 public:
#define FMI(name) name##TYPE* const name = reinterpret_cast<name##TYPE*>(find(#name))
  FMI(fmi2Instantiate);
  FMI(fmi2FreeInstance);
  FMI(fmi2EnterInitializationMode);
  FMI(fmi2ExitInitializationMode);
  FMI(fmi2SetReal);
  FMI(fmi2GetReal);
  FMI(fmi2DoStep);
  FMI(fmi2GetFMUstate);
  FMI(fmi2SetFMUstate);
  FMI(fmi2FreeFMUstate);
  FMI(fmi2SerializedFMUstateSize);
  FMI(fmi2SerializeFMUstate);
  FMI(fmi2DeSerializeFMUstate);
  FMI(fmi2GetDirectionalDerivative);
  FMI(fmi2EnterContinuousTimeMode);
  FMI(fmi2CompletedIntegratorStep);
  FMI(fmi2SetTime);
  FMI(fmi2SetContinuousStates);
  FMI(fmi2GetContinuousStates);
  FMI(fmi2GetDerivatives);
  FMI(fmi2Terminate);
  FMI(fmi2Reset);
#undef FMI

  void set(fmi2Component fmu, const std::vector<std::string>& inputs) const {
    for (const std::string& input : inputs) {
      const fmi2ValueReference vr = static_cast<unsigned>(std::stoul(input));
      const double value = std::stod(input.substr(input.find('=') + 1));
      expect(fmi2SetReal(fmu, &vr, 1, &value) == fmi2OK, "an input is refused");
    }
  }
};

const fmi2CallbackFunctions callbacks{quiet, std::calloc, std::free, nullptr, nullptr};

/// Euler's method, with a state saved in every step.
void exchange(const Functions& f, const Description& description, double h, const std::vector<std::string>& inputs) {
  const fmi2Component fmu =
      f.fmi2Instantiate("b", fmi2ModelExchange, description.guid.c_str(), "", &callbacks, fmi2False, fmi2True);
  expect(fmu, "no instance");
  expect(f.fmi2EnterInitializationMode(fmu) == fmi2OK, "no initialisation");
  f.set(fmu, inputs);
  expect(f.fmi2ExitInitializationMode(fmu) == fmi2OK, "initialisation fails");
  expect(f.fmi2EnterContinuousTimeMode(fmu) == fmi2OK, "no continuous time");
  expect(f.fmi2DoStep(fmu, 0.0, h, fmi2False) == fmi2Error, "co-simulation");
  std::vector<double> x(description.states), dx(description.states);
  for (int i = 0; i < 3; ++i) {
    fmi2FMUstate state = nullptr;
    expect(f.fmi2GetContinuousStates(fmu, x.data(), x.size()) == fmi2OK, "no states");
    expect(f.fmi2GetDerivatives(fmu, dx.data(), dx.size()) == fmi2OK, "no derivatives");
    expect(f.fmi2GetFMUstate(fmu, &state) == fmi2OK, "no state");
    for (std::size_t k = 0; k < x.size(); ++k) x[k] += 1e-6 * h * dx[k];
    expect(f.fmi2SetTime(fmu, (i + 1) * 1e-6 * h) == fmi2OK, "no time");
    expect(f.fmi2SetContinuousStates(fmu, x.data(), x.size()) == fmi2OK, "states refused");
    fmi2Boolean event = fmi2True, end = fmi2True;
    expect(f.fmi2CompletedIntegratorStep(fmu, fmi2True, &event, &end) <= fmi2Warning && !event && !end,
           "no end of step");
    expect(f.fmi2SetFMUstate(fmu, state) == fmi2OK, "no way back");
    expect(f.fmi2FreeFMUstate(fmu, &state) == fmi2OK, "state not freed");
  }
  const auto states = static_cast<unsigned>(description.states), last = static_cast<unsigned>(description.variables);
  const fmi2ValueReference unknown = last - states, known = last - 2 * states;  // derivatives stand last, states before
  const double seed = 1.0;
  double result = 0.0;
  expect(f.fmi2GetDirectionalDerivative(fmu, &unknown, 1, &known, 1, &seed, &result) == fmi2OK, "no derivative");
  f.fmi2FreeInstance(fmu);
}

void drive(const Functions& f, const std::string& guid, double h, const std::vector<std::string>& inputs) {
  expect(!f.fmi2Instantiate("a", fmi2CoSimulation, "{wrong}", "", &callbacks, fmi2False, fmi2False),
         "a wrong GUID loads");
  const fmi2Component fmu = f.fmi2Instantiate("a", fmi2CoSimulation, guid.c_str(), "", &callbacks, fmi2False, fmi2True);
  expect(fmu, "no instance");
  for (int run = 0; run < 2; ++run) {
    expect(f.fmi2DoStep(fmu, 0.0, h, fmi2False) == fmi2Error, "a step before initialisation");
    expect(f.fmi2EnterInitializationMode(fmu) == fmi2OK, "no initialisation");
    f.set(fmu, inputs);
    expect(f.fmi2ExitInitializationMode(fmu) == fmi2OK, "initialisation fails");
    for (int i = 0; i < 3; ++i) {
      fmi2FMUstate state = nullptr, copy = nullptr;
      size_t size = 0;
      expect(f.fmi2GetFMUstate(fmu, &state) == fmi2OK, "no state");
      expect(f.fmi2SerializedFMUstateSize(fmu, state, &size) == fmi2OK, "no size");
      std::vector<char> bytes(size);
      expect(f.fmi2SerializeFMUstate(fmu, state, bytes.data(), size) == fmi2OK, "no bytes");
      expect(f.fmi2DoStep(fmu, i * h, h, fmi2False) <= fmi2Warning, "a step fails");
      expect(f.fmi2DeSerializeFMUstate(fmu, bytes.data(), size, &copy) == fmi2OK, "bytes refused");
      bytes[size / 2] ^= 1;
      fmi2FMUstate none = nullptr;
      expect(f.fmi2DeSerializeFMUstate(fmu, bytes.data(), size, &none) == fmi2Error, "damaged bytes accepted");
      expect(f.fmi2SetFMUstate(fmu, copy) == fmi2OK, "no way back");
      expect(f.fmi2DoStep(fmu, i * h, h, fmi2False) <= fmi2Warning, "a repeated step fails");
      expect(f.fmi2FreeFMUstate(fmu, &state) == fmi2OK, "state not freed");  // the copy is left to the FMU
    }
    expect(f.fmi2SetTime(fmu, 0.0) == fmi2Error, "model exchange");
    expect(f.fmi2Terminate(fmu) == fmi2OK, "no end");
    expect(f.fmi2Reset(fmu) == fmi2OK, "no reset");
  }
  f.fmi2FreeInstance(fmu);
}

}  // namespace

int main(int count, char** arguments) try {
  expect(count >= 4, "arguments; usage: drive BINARY modelDescription.xml STEP [VR=VALUE ...]");
  void* library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
  if (!library) throw std::runtime_error(dlerror());
  const Functions functions(library);
  const Description description(arguments[2]);
  const double h = std::stod(arguments[3]);
  const std::vector<std::string> inputs{arguments + 4, arguments + count};
  drive(functions, description.guid, h, inputs);
  exchange(functions, description, h, inputs);
  dlclose(library);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
