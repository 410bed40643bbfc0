// All functions of FMI 2.0 of one binary, and what its modelDescription.xml says, for hosts written in C++.
#pragma once

#include <dlfcn.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "fmi2FunctionTypes.h"

namespace host {

struct Variable {
  std::string name, causality, variability, type;
  fmi2ValueReference reference = 0;
  double least = -std::numeric_limits<double>::infinity(), most = -least, start = 0.0;
};

/// The value of an attribute in a tag, or `missing`.
inline std::string attribute(const std::string& tag, const std::string& name, const std::string& missing = "") {
  const auto at = tag.find(" " + name + "=\"");
  if (at == std::string::npos) return missing;
  const auto from = at + name.size() + 3;
  return tag.substr(from, tag.find('"', from) - from);
}

inline double number(const std::string& text) {
  if (text == "true") return 1.0;
  return text == "false" || text.empty() ? 0.0 : std::stod(text);
}

/// What this project's own descriptions contain; not a parser of XML.
struct Description {
  explicit Description(const char* path) {
    std::ifstream file(path);
    const std::string xml{std::istreambuf_iterator<char>(file), {}};
    guid = attribute(xml, "guid");
    for (auto at = xml.find("<ScalarVariable"); at != std::string::npos; at = xml.find("<ScalarVariable", at + 1)) {
      const std::string tag = xml.substr(at, xml.find('>', at) - at);
      const auto inner = xml.find('<', at + tag.size());
      const std::string typed = xml.substr(inner, xml.find('>', inner) - inner);
      Variable v;
      v.name = attribute(tag, "name");
      v.causality = attribute(tag, "causality");
      v.variability = attribute(tag, "variability");
      v.reference = static_cast<fmi2ValueReference>(std::stoul(attribute(tag, "valueReference")));
      v.type = typed.substr(1, typed.find_first_of(" /") - 1);
      v.least = number(attribute(typed, "min", "-inf"));
      v.most = number(attribute(typed, "max", "inf"));
      v.start = number(attribute(typed, "start"));
      if (v.causality == "local" && attribute(typed, "derivative").empty()) states.push_back(v.reference);
      variables.push_back(v);
    }
    if (guid.empty() || variables.empty()) throw std::runtime_error(std::string("no description: ") + path);
  }
  std::string guid;
  std::vector<Variable> variables;
  std::vector<fmi2ValueReference> states;
};

class Library {
 public:
  explicit Library(const char* path) : handle_(dlopen(path, RTLD_NOW | RTLD_LOCAL)) {
    if (!handle_) throw std::runtime_error(dlerror());
    const auto load = [this](auto& function, const char* name) {
      void* symbol = dlsym(handle_, name);
      if (!symbol) throw std::runtime_error(std::string("the binary lacks ") + name);
      function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(symbol);
    };
#define LOAD(name) load(name, "fmi2" #name)
    LOAD(GetTypesPlatform), LOAD(GetVersion), LOAD(SetDebugLogging), LOAD(Instantiate), LOAD(FreeInstance);
    LOAD(SetupExperiment), LOAD(EnterInitializationMode), LOAD(ExitInitializationMode), LOAD(Terminate), LOAD(Reset);
    LOAD(GetReal), LOAD(GetInteger), LOAD(GetBoolean), LOAD(GetString);
    LOAD(SetReal), LOAD(SetInteger), LOAD(SetBoolean), LOAD(SetString);
    LOAD(GetFMUstate), LOAD(SetFMUstate), LOAD(FreeFMUstate), LOAD(SerializedFMUstateSize), LOAD(SerializeFMUstate);
    LOAD(DeSerializeFMUstate), LOAD(GetDirectionalDerivative);
    LOAD(EnterEventMode), LOAD(NewDiscreteStates), LOAD(EnterContinuousTimeMode), LOAD(CompletedIntegratorStep);
    LOAD(SetTime), LOAD(SetContinuousStates), LOAD(GetDerivatives), LOAD(GetEventIndicators);
    LOAD(GetContinuousStates), LOAD(GetNominalsOfContinuousStates);
    LOAD(SetRealInputDerivatives), LOAD(GetRealOutputDerivatives), LOAD(DoStep), LOAD(CancelStep);
    LOAD(GetStatus), LOAD(GetRealStatus), LOAD(GetIntegerStatus), LOAD(GetBooleanStatus), LOAD(GetStringStatus);
#undef LOAD
  }
  Library(const Library&) = delete;
  ~Library() { dlclose(handle_); }

#define FUNCTION(name) fmi2##name##TYPE* name = nullptr
  FUNCTION(GetTypesPlatform);
  FUNCTION(GetVersion);
  FUNCTION(SetDebugLogging);
  FUNCTION(Instantiate);
  FUNCTION(FreeInstance);
  FUNCTION(SetupExperiment);
  FUNCTION(EnterInitializationMode);
  FUNCTION(ExitInitializationMode);
  FUNCTION(Terminate);
  FUNCTION(Reset);
  FUNCTION(GetReal);
  FUNCTION(GetInteger);
  FUNCTION(GetBoolean);
  FUNCTION(GetString);
  FUNCTION(SetReal);
  FUNCTION(SetInteger);
  FUNCTION(SetBoolean);
  FUNCTION(SetString);
  FUNCTION(GetFMUstate);
  FUNCTION(SetFMUstate);
  FUNCTION(FreeFMUstate);
  FUNCTION(SerializedFMUstateSize);
  FUNCTION(SerializeFMUstate);
  FUNCTION(DeSerializeFMUstate);
  FUNCTION(GetDirectionalDerivative);
  FUNCTION(EnterEventMode);
  FUNCTION(NewDiscreteStates);
  FUNCTION(EnterContinuousTimeMode);
  FUNCTION(CompletedIntegratorStep);
  FUNCTION(SetTime);
  FUNCTION(SetContinuousStates);
  FUNCTION(GetDerivatives);
  FUNCTION(GetEventIndicators);
  FUNCTION(GetContinuousStates);
  FUNCTION(GetNominalsOfContinuousStates);
  FUNCTION(SetRealInputDerivatives);
  FUNCTION(GetRealOutputDerivatives);
  FUNCTION(DoStep);
  FUNCTION(CancelStep);
  FUNCTION(GetStatus);
  FUNCTION(GetRealStatus);
  FUNCTION(GetIntegerStatus);
  FUNCTION(GetBooleanStatus);
  FUNCTION(GetStringStatus);
#undef FUNCTION

 private:
  void* handle_;
};

}  // namespace host
