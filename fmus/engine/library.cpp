#include "engine/library.hpp"

#include <stdexcept>

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

namespace engine {
namespace {

#ifdef _WIN32
void* open(const std::string& path) { return reinterpret_cast<void*>(LoadLibraryA(path.c_str())); }
void close(void* handle) { FreeLibrary(static_cast<HMODULE>(handle)); }
void* symbol(void* handle, const char* name) {
  return reinterpret_cast<void*>(GetProcAddress(static_cast<HMODULE>(handle), name));
}
#else
void* open(const std::string& path) { return dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL); }
void close(void* handle) { dlclose(handle); }
void* symbol(void* handle, const char* name) { return dlsym(handle, name); }
#endif

}  // namespace

Library::Library(const std::string& path) : handle_(open(path)) {
  if (!handle_) throw std::runtime_error(path + " cannot be loaded");
  const auto find = [&](auto*& function, const char* name) {
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(symbol(handle_, name));
    if (!function) {
      close(handle_);
      throw std::runtime_error(path + " lacks " + name);
    }
  };
  find(instantiate, "fmi2Instantiate");
  find(free_instance, "fmi2FreeInstance");
  find(setup_experiment, "fmi2SetupExperiment");
  find(enter_initialization, "fmi2EnterInitializationMode");
  find(exit_initialization, "fmi2ExitInitializationMode");
  find(reset, "fmi2Reset");
  find(get_real, "fmi2GetReal");
  find(set_real, "fmi2SetReal");
  find(set_integer, "fmi2SetInteger");
  find(set_boolean, "fmi2SetBoolean");
  find(set_string, "fmi2SetString");
  find(set_input_derivatives, "fmi2SetRealInputDerivatives");
  find(get_output_derivatives, "fmi2GetRealOutputDerivatives");
  find(do_step, "fmi2DoStep");
  find(get_state, "fmi2GetFMUstate");
  find(set_state, "fmi2SetFMUstate");
  find(free_state, "fmi2FreeFMUstate");
}

Library::~Library() { close(handle_); }

}  // namespace engine
