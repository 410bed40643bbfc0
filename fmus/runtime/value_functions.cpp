// The C functions of FMI 2.0 that get and set values and derivatives.

#include "runtime/call.hpp"

using fmu::Access;
using fmu::Call;
using fmu::Error;
using fmu::Instance;
using fmu::need_if;
using fmu::run;
namespace call = fmu::call;

namespace {

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

[[noreturn]] void refuse_strings() { throw Error("this FMU has no String variables"); }

}  // namespace

extern "C" {

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

}  // extern "C"
