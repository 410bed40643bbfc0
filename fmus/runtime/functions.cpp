// The C functions of FMI 2.0 that every FMU has: creation, logging, life cycle.
#include <memory>
#include <optional>
#include <string>

#include "runtime/call.hpp"
#include "runtime/resources.hpp"

using fmu::Error;
using fmu::Instance;
using fmu::Mode;
using fmu::need_if;
using fmu::number_of;
using fmu::run;
namespace call = fmu::call;
namespace category = fmu::category;

namespace {

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

}  // namespace

extern "C" {

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

}  // extern "C"
