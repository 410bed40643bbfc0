// How the C functions of FMI 2.0 call an instance. Everything is caught here and nowhere else: a refused or failed call
// is logged once, returns fmi2Error and leaves the process alive.
#pragma once

#include <cstring>
#include <exception>
#include <string>
#include <type_traits>

#include "fmi2Functions.h"
#include "runtime/instance.hpp"

namespace fmu {

/// Runs `body(instance)` if the standard allows `call` now. A body that returns nothing means fmi2OK, or fmi2Warning
/// when the model warned.
template <class Body>
fmi2Status run(fmi2Component component, const Call& call, Body&& body) noexcept {
  auto* instance = static_cast<Instance*>(component);
  if (!instance) return fmi2Error;
  try {
    instance->permit(call);
    instance->take_warning();  // one that a failed call left behind
    fmi2Status status = fmi2OK;
    if constexpr (std::is_same_v<decltype(body(*instance)), fmi2Status>)
      status = body(*instance);
    else
      body(*instance);
    return status == fmi2OK && instance->take_warning() ? fmi2Warning : status;
  } catch (const Error& error) {
    const bool is_discard = error.severity() == core::Severity::discard;
    instance->log().write(is_discard ? category::discard : category::error,
                          std::string(call.name) + ": " + error.what());
    return is_discard ? fmi2Discard : fmi2Error;
  } catch (const std::exception& error) {
    instance->log().write(category::error, std::string(call.name) + ": " + error.what());
    return fmi2Error;
  } catch (...) {
    instance->set_mode(Mode::fatal);
    instance->log().write(category::fatal, std::string(call.name) + ": unknown failure; free the instance");
    return fmi2Fatal;
  }
}

template <class... Pointers>
void need(const Pointers*... pointers) {
  if ((!pointers || ...)) throw Error("a null pointer was passed; pass the arrays and results that the function needs");
}

/// Like need(), for arrays that may be null when they are empty.
template <class... Pointers>
void need_if(size_t count, const Pointers*... pointers) {
  if (count > 0) need(pointers...);
}

/// The number of an enumerator that a host passes: values outside of a C enumeration must not be loaded as such.
template <class Enumeration>
int number_of(const Enumeration& enumerator) {
  static_assert(sizeof(Enumeration) == sizeof(int));
  int number = 0;
  std::memcpy(&number, &enumerator, sizeof number);
  return number;
}

}  // namespace fmu
