// The C functions of FMI 2.0. Everything is caught here and nowhere else: a refused or failed call is logged once,
// returns fmi2Error and leaves the process alive.
#include <cstring>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>

#include "fmi2Functions.h"
#include "runtime/instance.hpp"
#include "runtime/resources.hpp"

namespace {

using fmu::Access;
using fmu::Call;
using fmu::Error;
using fmu::Instance;
using fmu::Mode;
using fmu::Snapshot;
namespace call = fmu::call;
namespace category = fmu::category;

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

template <Access access>
fmi2Status get(fmi2Component c, const Call& call, const fmi2ValueReference vr[], size_t nvr,
               fmu::ValueOf<access> value[]) {
  return run(c, call, [&](Instance& instance) {
    need_if(nvr, vr, value);
    instance.get<access>({vr, nvr}, value);
  });
}

template <Access access>
fmi2Status set(fmi2Component c, const Call& call, const fmi2ValueReference vr[], size_t nvr,
               const fmu::ValueOf<access> value[]) {
  return run(c, call, [&](Instance& instance) {
    need_if(nvr, vr, value);
    instance.set<access>({vr, nvr}, value);
  });
}

/// The number of an enumerator that a host passes: values outside of a C enumeration must not be loaded as such.
template <class Enumeration>
int number_of(const Enumeration& enumerator) {
  static_assert(sizeof(Enumeration) == sizeof(int));
  int number = 0;
  std::memcpy(&number, &enumerator, sizeof number);
  return number;
}

/// The blueprint of that GUID: the default one, or that of the configuration in the resources. Throws Error.
std::shared_ptr<const fmu::Blueprint> blueprint_of(fmi2String guid, fmi2String resources) {
  auto blueprint = fmu::Blueprint::of({});
  if (guid && blueprint->guid == guid) return blueprint;
  const std::string problem = "GUID " + std::string(guid ? guid : "(null)") + " was given, this binary has " +
                              blueprint->guid + " at its default size";
  const std::string remedy = "; modelDescription.xml and binary are of different builds, build the FMU again";
  try {
    blueprint = fmu::Blueprint::of(fmu::read_configuration_file(resources ? resources : ""));
  } catch (const std::exception& error) {
    throw Error(problem + ", and at another: " + error.what() + remedy);
  }
  if (guid && blueprint->guid == guid) return blueprint;
  throw Error(problem + " and " + blueprint->guid + " for the configuration in its resources" + remedy);
}

[[noreturn]] void refuse_strings() { throw Error("this FMU has no String variables"); }

}  // namespace

extern "C" {

// ---------------------------------------------------------------- inquiry, creation, logging

const char* fmi2GetTypesPlatform() { return fmi2TypesPlatform; }

const char* fmi2GetVersion() { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions* functions, fmi2Boolean,
                              fmi2Boolean loggingOn) try {
  const std::string name = instanceName ? instanceName : "";
  try {
    if (!instanceName || !*instanceName) throw Error("the instance needs a name that is not empty");
    auto blueprint = blueprint_of(fmuGUID, fmuResourceLocation);
    const int type = number_of(fmuType);
    if (type != fmi2CoSimulation && type != fmi2ModelExchange)
      throw Error("fmuType " + std::to_string(type) + "; allowed: 0 (model exchange), 1 (co-simulation)");
    const auto interface = type == fmi2CoSimulation ? fmu::Interface::co_simulation : fmu::Interface::model_exchange;
    return std::make_unique<Instance>(std::move(blueprint), interface,
                                      fmu::Log(name, functions, loggingOn != fmi2False))
        .release();
  } catch (const std::exception& error) {
    // Logged whatever loggingOn says: there is no instance that could be asked.
    fmu::Log(name, functions, true).write(category::error, std::string("fmi2Instantiate: ") + error.what());
    return nullptr;
  }
} catch (...) {
  return nullptr;
}

void fmi2FreeInstance(fmi2Component c) { delete static_cast<Instance*>(c); }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
  return run(c, call::set_debug_logging, [&](Instance& instance) {
    need_if(nCategories, categories);
    instance.log().enable(loggingOn != fmi2False, {categories, nCategories});
  });
}

// ---------------------------------------------------------------- life cycle

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
  return run(c, call::setup_experiment, [&](Instance& instance) {
    instance.setup_experiment(toleranceDefined ? std::optional(tolerance) : std::nullopt, startTime,
                              stopTimeDefined ? std::optional(stopTime) : std::nullopt);
  });
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  return run(c, call::enter_initialization, [](Instance& instance) { instance.set_mode(Mode::initialization); });
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  return run(c, call::exit_initialization, [](Instance& instance) { instance.exit_initialization(); });
}

fmi2Status fmi2Terminate(fmi2Component c) {
  return run(c, call::terminate, [](Instance& instance) { instance.set_mode(Mode::terminated); });
}

fmi2Status fmi2Reset(fmi2Component c) {
  return run(c, call::reset, [](Instance& instance) { instance.reset(); });
}

// ---------------------------------------------------------------- values

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
  return get<Access::real>(c, call::get_real, vr, nvr, value);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
  return get<Access::integer>(c, call::get_integer, vr, nvr, value);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
  return get<Access::boolean>(c, call::get_boolean, vr, nvr, value);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference[], size_t nvr, fmi2String[]) {
  return run(c, call::get_string, [&](Instance&) { nvr > 0 ? refuse_strings() : void(); });
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
  return set<Access::real>(c, call::set_real, vr, nvr, value);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
  return set<Access::integer>(c, call::set_integer, vr, nvr, value);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
  return set<Access::boolean>(c, call::set_boolean, vr, nvr, value);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference[], size_t nvr, const fmi2String[]) {
  return run(c, call::set_string, [&](Instance&) { nvr > 0 ? refuse_strings() : void(); });
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
  return run(c, call::set_input_derivatives, [&](Instance& instance) {
    need_if(nvr, vr, order, value);
    instance.set_input_derivatives({vr, nvr}, order, value);
  });
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
  return run(c, call::get_output_derivatives, [&](Instance& instance) {
    need_if(nvr, vr, order, value);
    instance.get_output_derivatives({vr, nvr}, order, value);
  });
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
  return run(c, call::directional_derivative, [&](Instance& instance) {
    need_if(nUnknown, vUnknown_ref, dvUnknown);
    need_if(nKnown, vKnown_ref, dvKnown);
    instance.directional_derivative({vUnknown_ref, nUnknown}, {vKnown_ref, nKnown}, dvKnown, dvUnknown);
  });
}

// ---------------------------------------------------------------- state

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* FMUstate) {
  return run(c, call::get_state, [&](Instance& instance) {
    need(FMUstate);
    if (*FMUstate) return instance.save(instance.find(*FMUstate));
    auto snapshot = std::make_unique<Snapshot>();
    instance.save(*snapshot);
    *FMUstate = instance.add(std::move(snapshot));
  });
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
  return run(c, call::set_state, [&](Instance& instance) { instance.restore(instance.find(FMUstate)); });
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate* FMUstate) {
  return run(c, call::free_state, [&](Instance& instance) {
    if (!FMUstate || !*FMUstate) return;  // as the standard asks
    instance.remove(*FMUstate);
    *FMUstate = nullptr;
  });
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t* size) {
  return run(c, call::state_size, [&](Instance& instance) {
    need(size);
    *size = fmu::serialised_size(instance.blueprint(), instance.find(FMUstate));
  });
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
  return run(c, call::serialize_state, [&](Instance& instance) {
    need(serializedState);
    const Snapshot& snapshot = instance.find(FMUstate);
    if (const size_t needed = fmu::serialised_size(instance.blueprint(), snapshot); size != needed)
      throw Error("room for " + std::to_string(size) + " bytes was given, " + std::to_string(needed) +
                  " are needed; ask fmi2SerializedFMUstateSize");
    fmu::serialise(instance.blueprint(), snapshot, std::as_writable_bytes(std::span(serializedState, size)));
  });
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate* FMUstate) {
  return run(c, call::deserialize_state, [&](Instance& instance) {
    need(serializedState, FMUstate);
    Snapshot snapshot = instance.deserialise(std::as_bytes(std::span(serializedState, size)));
    if (*FMUstate)
      instance.find(*FMUstate) = std::move(snapshot);
    else
      *FMUstate = instance.add(std::make_unique<Snapshot>(std::move(snapshot)));
  });
}

// ---------------------------------------------------------------- co-simulation

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean) {
  return run(c, call::do_step, [&](Instance& instance) {
    return instance.step(currentCommunicationPoint, communicationStepSize) ? fmi2OK : fmi2Discard;
  });
}

fmi2Status fmi2CancelStep(fmi2Component c) {
  return run(c, call::cancel_step, [](Instance&) {});
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status* value) {
  return run(c, call::get_status, [&](Instance& instance) {
    need(value);
    if (number_of(s) != fmi2DoStepStatus) return fmi2Discard;
    *value = instance.progress().mode == Mode::step_failed ? fmi2Discard : fmi2OK;
    return fmi2OK;
  });
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real* value) {
  return run(c, call::get_real_status, [&](Instance& instance) {
    need(value);
    if (number_of(s) != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = instance.progress().time;
    return fmi2OK;
  });
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind, fmi2Integer*) {
  return run(c, call::get_integer_status, [](Instance&) { return fmi2Discard; });  // the standard has no such kind
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean* value) {
  return run(c, call::get_boolean_status, [&](Instance&) {
    need(value);
    if (number_of(s) != fmi2Terminated) return fmi2Discard;
    *value = fmi2False;  // these models never end a simulation by themselves
    return fmi2OK;
  });
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind, fmi2String*) {
  return run(c, call::get_string_status, [](Instance&) { return fmi2Discard; });  // only for steps that are pending
}

// ---------------------------------------------------------------- model exchange: there are no events

fmi2Status fmi2EnterEventMode(fmi2Component c) {
  return run(c, call::enter_event_mode, [](Instance& instance) { instance.set_mode(Mode::event); });
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo* eventInfo) {
  return run(c, call::new_discrete_states, [&](Instance&) {
    need(eventInfo);
    *eventInfo = {};  // nothing left to do, nothing changed, no time event to come
  });
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
  return run(c, call::enter_continuous_time_mode, [](Instance& instance) { instance.set_mode(Mode::continuous); });
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean, fmi2Boolean* enterEventMode,
                                       fmi2Boolean* terminateSimulation) {
  return run(c, call::completed_integrator_step, [&](Instance& instance) {
    need(enterEventMode, terminateSimulation);
    instance.complete_step();
    *enterEventMode = *terminateSimulation = fmi2False;
  });
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
  return run(c, call::set_time, [&](Instance& instance) { instance.set_time(time); });
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
  return run(c, call::set_continuous_states, [&](Instance& instance) {
    need_if(nx, x);
    instance.set_states({x, nx});
  });
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx) {
  return run(c, call::get_derivatives, [&](Instance& instance) {
    need_if(nx, derivatives);
    instance.get_derivatives({derivatives, nx});
  });
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real[], size_t ni) {
  return run(c, call::get_event_indicators, [&](Instance&) {
    if (ni != 0) throw Error("room for " + std::to_string(ni) + " event indicators, this FMU has none");
  });
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx) {
  return run(c, call::get_continuous_states, [&](Instance& instance) {
    need_if(nx, x);
    instance.get_states({x, nx});
  });
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx) {
  return run(c, call::get_nominals, [&](Instance& instance) {
    need_if(nx, x_nominal);
    instance.get_nominals({x_nominal, nx});
  });
}

}  // extern "C"
