// The C functions of FMI 2.0 for model exchange. The only events are jumps of inputs that the host made without one.
#include <string>

#include "runtime/call.hpp"

using fmu::Error;
using fmu::Instance;
using fmu::Mode;
using fmu::need;
using fmu::need_if;
using fmu::run;
namespace call = fmu::call;

extern "C" {

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
    *enterEventMode = instance.complete_step() ? fmi2True : fmi2False;
    *terminateSimulation = fmi2False;
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
