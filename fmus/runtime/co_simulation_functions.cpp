// The C functions of FMI 2.0 for co-simulation: steps and their status.

#include "runtime/call.hpp"

using fmu::Instance;
using fmu::Mode;
using fmu::need;
using fmu::number_of;
using fmu::run;
namespace call = fmu::call;

extern "C" {

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

}  // extern "C"
