// drive BINARY modelDescription.xml STEP [VR=VALUE ...]: loads an FMU as any host does and runs a short co-simulation
// with all that allocates: saved, restored, serialised and leaked states, refused calls. Under valgrind it shows that
// nothing leaks.
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

std::string guid_in(const char* path) {
  std::ifstream file(path);
  const std::string xml{std::istreambuf_iterator<char>(file), {}};
  const auto start = xml.find("guid=\"");
  expect(start != std::string::npos, "no guid in the description");
  return xml.substr(start + 6, xml.find('"', start + 6) - start - 6);
}

void drive(void* library, const std::string& guid, double h, const std::vector<std::string>& inputs) {
  const auto function = [library](const char* name) {
    void* symbol = dlsym(library, name);
    expect(symbol, name);
    return symbol;
  };
#define FMI(name) const auto name = reinterpret_cast<name##TYPE*>(function(#name))
  FMI(fmi2Instantiate);
  FMI(fmi2FreeInstance);
  FMI(fmi2EnterInitializationMode);
  FMI(fmi2ExitInitializationMode);
  FMI(fmi2SetReal);
  FMI(fmi2DoStep);
  FMI(fmi2GetFMUstate);
  FMI(fmi2SetFMUstate);
  FMI(fmi2FreeFMUstate);
  FMI(fmi2SerializedFMUstateSize);
  FMI(fmi2SerializeFMUstate);
  FMI(fmi2DeSerializeFMUstate);
  FMI(fmi2SetTime);
  FMI(fmi2Terminate);
  FMI(fmi2Reset);
#undef FMI
  const fmi2CallbackFunctions callbacks{quiet, std::calloc, std::free, nullptr, nullptr};
  expect(!fmi2Instantiate("a", fmi2CoSimulation, "{wrong}", "", &callbacks, fmi2False, fmi2False),
         "a wrong GUID loads");
  const fmi2Component fmu = fmi2Instantiate("a", fmi2CoSimulation, guid.c_str(), "", &callbacks, fmi2False, fmi2True);
  expect(fmu, "no instance");
  for (int run = 0; run < 2; ++run) {
    expect(fmi2DoStep(fmu, 0.0, h, fmi2False) == fmi2Error, "a step before initialisation");
    expect(fmi2EnterInitializationMode(fmu) == fmi2OK, "no initialisation");
    for (const std::string& input : inputs) {
      const fmi2ValueReference vr = static_cast<unsigned>(std::stoul(input));
      const double value = std::stod(input.substr(input.find('=') + 1));
      expect(fmi2SetReal(fmu, &vr, 1, &value) == fmi2OK, "an input is refused");
    }
    expect(fmi2ExitInitializationMode(fmu) == fmi2OK, "initialisation fails");
    for (int i = 0; i < 3; ++i) {
      fmi2FMUstate state = nullptr, copy = nullptr;
      size_t size = 0;
      expect(fmi2GetFMUstate(fmu, &state) == fmi2OK, "no state");
      expect(fmi2SerializedFMUstateSize(fmu, state, &size) == fmi2OK, "no size");
      std::vector<char> bytes(size);
      expect(fmi2SerializeFMUstate(fmu, state, bytes.data(), size) == fmi2OK, "no bytes");
      expect(fmi2DoStep(fmu, i * h, h, fmi2False) <= fmi2Warning, "a step fails");
      expect(fmi2DeSerializeFMUstate(fmu, bytes.data(), size, &copy) == fmi2OK, "bytes refused");
      bytes[size / 2] ^= 1;
      fmi2FMUstate none = nullptr;
      expect(fmi2DeSerializeFMUstate(fmu, bytes.data(), size, &none) == fmi2Error, "damaged bytes accepted");
      expect(fmi2SetFMUstate(fmu, copy) == fmi2OK, "no way back");
      expect(fmi2DoStep(fmu, i * h, h, fmi2False) <= fmi2Warning, "a repeated step fails");
      expect(fmi2FreeFMUstate(fmu, &state) == fmi2OK, "state not freed");  // the copy is left to the FMU
    }
    expect(fmi2SetTime(fmu, 0.0) == fmi2Error, "model exchange");
    expect(fmi2Terminate(fmu) == fmi2OK, "no end");
    expect(fmi2Reset(fmu) == fmi2OK, "no reset");
  }
  fmi2FreeInstance(fmu);
}

}  // namespace

int main(int count, char** arguments) try {
  expect(count >= 4, "arguments; usage: drive BINARY modelDescription.xml STEP [VR=VALUE ...]");
  void* library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
  if (!library) throw std::runtime_error(dlerror());
  drive(library, guid_in(arguments[2]), std::stod(arguments[3]), {arguments + 4, arguments + count});
  dlclose(library);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
