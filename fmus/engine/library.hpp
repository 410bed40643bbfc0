// An FMU's shared library and its functions for co-simulation.
#pragma once

#include <fmi2FunctionTypes.h>

#include <memory>
#include <string>

namespace engine {

struct Library {
  explicit Library(const std::string& path);  // throws std::runtime_error
  ~Library();
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  fmi2InstantiateTYPE* instantiate;
  fmi2FreeInstanceTYPE* free_instance;
  fmi2SetupExperimentTYPE* setup_experiment;
  fmi2EnterInitializationModeTYPE* enter_initialization;
  fmi2ExitInitializationModeTYPE* exit_initialization;
  fmi2ResetTYPE* reset;
  fmi2GetRealTYPE* get_real;
  fmi2SetRealTYPE* set_real;
  fmi2SetIntegerTYPE* set_integer;
  fmi2SetBooleanTYPE* set_boolean;
  fmi2SetStringTYPE* set_string;
  fmi2SetRealInputDerivativesTYPE* set_input_derivatives;
  fmi2GetRealOutputDerivativesTYPE* get_output_derivatives;
  fmi2DoStepTYPE* do_step;
  fmi2GetFMUstateTYPE* get_state;
  fmi2SetFMUstateTYPE* set_state;
  fmi2FreeFMUstateTYPE* free_state;

 private:
  void* handle_;
};

}  // namespace engine
