// The random walk: which calls it makes, and what holds for all of them.
#include "walk.hpp"

#include <cmath>
#include <cstdlib>

namespace host {

Walk::Walk(const Library& fmu, const Description& description, std::uint64_t seed)
    : fmu_(fmu), description_(description), random_(seed), is_slave_(seed % 2 == 0) {
  callbacks_ = {log, std::calloc, std::free, nullptr, this};
  for (const Variable& v : description_.variables) {
    if (v.causality == "input") inputs_.push_back(&v);
    if (v.causality == "output" && v.type == "Real") outputs_.push_back(&v);
    if (v.type == "Real") reals_.push_back(&v);
  }
  create();
}

void Walk::run(long calls) {
  for (long k = 0; k < calls; ++k) {
    const auto& action = kActions[pick(kActions.size())];
    const bool is_allowed =
        (action.modes & in(mode_)) && action.interface != (is_slave_ ? Interface::exchange : Interface::slave);
    // Illegal calls are tried now and then, and always when they would be told apart by nothing but the state.
    if (!is_allowed && chance(0.7)) continue;
    ++counts.calls;
    name_ = action.name;
    messages_ = 0;
    std::vector<char> before;
    const bool is_watched = !is_allowed && chance(0.2);
    if (is_watched) before = bytes();
    messages_ = 0;
    is_bad_ = is_allowed && action.has_arguments && chance(0.15);
    if (is_bad_ && chance(0.3)) before = bytes();
    messages_ = 0;
    const fmi2Status status = (this->*action.call)();
    if (!is_allowed || is_bad_) {
      ++(is_allowed ? counts.bad : counts.illegal);
      expect(status == fmi2Error, is_allowed ? "bad arguments are not refused" : "an illegal call is not refused");
      expect(messages_ == 1, "a refusal is not logged exactly once");
      if (!before.empty()) expect(bytes() == before, "a refused call changed the instance");
    } else {
      expect(status <= fmi2Error, "fatal");
      if (status == fmi2Discard) ++counts.discards;
      if (status == fmi2Error) ++counts.errors;
    }
  }
}

void Walk::create() {
  instance_ = fmu_.Instantiate("walk", is_slave_ ? fmi2CoSimulation : fmi2ModelExchange, description_.guid.c_str(), "",
                               &callbacks_, fmi2False, fmi2True);
  const fmi2String events = "logEvents";
  fmu_.SetDebugLogging(instance_, fmi2False, 1, &events);
  mode_ = instantiated;
}

std::vector<char> Walk::bytes() {
  fmi2FMUstate state = nullptr;
  std::size_t size = 0;
  expect(fmu_.GetFMUstate(instance_, &state) == fmi2OK, "a state cannot be saved");
  expect(fmu_.SerializedFMUstateSize(instance_, state, &size) == fmi2OK, "a state has no size");
  std::vector<char> result(size);
  expect(fmu_.SerializeFMUstate(instance_, state, result.data(), size) == fmi2OK, "a state cannot be serialised");
  expect(fmu_.FreeFMUstate(instance_, &state) == fmi2OK, "a state cannot be freed");
  return result;
}

fmi2Status Walk::debug() {
  const fmi2String good = "logStatusWarning", bad = "noSuchCategory";
  return fmu_.SetDebugLogging(instance_, fmi2True, 1, is_bad_ ? &bad : &good);
}

fmi2Status Walk::setup() {
  const fmi2Status status = fmu_.SetupExperiment(instance_, fmi2True, is_bad_ ? -1.0 : 1e-3, 0.0, fmi2False, 0.0);
  if (status <= fmi2Warning) time_ = 0.0;
  return status;
}

fmi2Status Walk::enter() { return moved(fmu_.EnterInitializationMode(instance_), instantiated, initialization); }

fmi2Status Walk::leave() {
  return moved(fmu_.ExitInitializationMode(instance_), initialization, is_slave_ ? running : event);
}

fmi2Status Walk::terminate() {
  if (mode_ != terminated && chance(0.9) && (in(mode_) & (kSlave | kExchange))) return fmi2OK;  // rarely: walks go on
  return moved(fmu_.Terminate(instance_), mode_, terminated);
}

fmi2Status Walk::reset() {
  if (!(in(mode_)&kEnd) && chance(0.9)) return fmi2OK;
  const fmi2Status status = fmu_.Reset(instance_);
  if (status <= fmi2Warning) mode_ = instantiated, time_ = 0.0;
  return status;
}

fmi2Status Walk::moved(fmi2Status status, Mode from, Mode to) {
  if (status <= fmi2Warning && mode_ == from) mode_ = to;
  return status;
}

fmi2Status Walk::inquire() {
  expect(std::string(fmu_.GetVersion()) == "2.0" && fmu_.GetTypesPlatform(), "no version");
  return fmi2OK;
}

fmi2Status Walk::recreate() {
  if (!chance(0.01)) return fmi2OK;
  fmu_.FreeInstance(instance_);
  time_ = 0.0;
  create();
  return fmi2OK;
}

const std::vector<Walk::Action> Walk::kActions{
    {"fmi2GetVersion", ~0u, false, &Walk::inquire},
    {"fmi2Instantiate", ~0u, false, &Walk::recreate},
    {"fmi2SetDebugLogging", kLive, true, &Walk::debug},
    {"fmi2SetupExperiment", in(instantiated), true, &Walk::setup},
    {"fmi2EnterInitializationMode", in(instantiated), false, &Walk::enter},
    {"fmi2ExitInitializationMode", in(initialization), false, &Walk::leave},
    {"fmi2Terminate", kSlave | kExchange, false, &Walk::terminate},
    {"fmi2Reset", kLive, false, &Walk::reset},
    {"fmi2GetReal", kRead, true, &Walk::get_real},
    {"fmi2GetInteger", kRead, true, &Walk::get_integer},
    {"fmi2GetBoolean", kRead, true, &Walk::get_boolean},
    {"fmi2GetString", kRead, true, &Walk::get_string},
    {"fmi2SetReal", kSet, true, &Walk::set_real},
    {"fmi2SetInteger", kSet & ~in(continuous), true, &Walk::set_integer},
    {"fmi2SetBoolean", kSet & ~in(continuous), true, &Walk::set_boolean},
    {"fmi2SetString", kSet & ~in(continuous), true, &Walk::set_string},
    {"fmi2GetFMUstate", kLive, true, &Walk::save},
    {"fmi2SetFMUstate", kLive, true, &Walk::restore},
    {"fmi2FreeFMUstate", kLive, true, &Walk::free_state},
    {"fmi2SerializedFMUstateSize", 0, false, &Walk::size_of_state},
    {"fmi2SerializeFMUstate", 0, false, &Walk::serialise},
    {"fmi2DeSerializeFMUstate", kLive, false, &Walk::deserialise},
    {"fmi2GetDirectionalDerivative", kRead, true, &Walk::directional},
    {"fmi2SetRealInputDerivatives", kSet, true, &Walk::set_derivatives, Interface::slave},
    {"fmi2GetRealOutputDerivatives", kSlave | kEnd, true, &Walk::output_derivatives, Interface::slave},
    {"fmi2DoStep", kSlave, true, &Walk::step, Interface::slave},
    {"fmi2CancelStep", 0, false, &Walk::cancel, Interface::slave},
    {"fmi2GetStatus", kSlave | in(terminated), false, &Walk::get_status, Interface::slave},
    {"fmi2GetRealStatus", kSlave | in(terminated), false, &Walk::get_real_status, Interface::slave},
    {"fmi2GetIntegerStatus", kSlave | in(terminated), false, &Walk::get_integer_status, Interface::slave},
    {"fmi2GetBooleanStatus", kSlave | in(terminated), false, &Walk::get_boolean_status, Interface::slave},
    {"fmi2GetStringStatus", kSlave | in(terminated), false, &Walk::get_string_status, Interface::slave},
    {"fmi2EnterEventMode", kExchange, false, &Walk::event_mode, Interface::exchange},
    {"fmi2NewDiscreteStates", in(event), true, &Walk::new_states, Interface::exchange},
    {"fmi2EnterContinuousTimeMode", in(event), false, &Walk::continuous_mode, Interface::exchange},
    {"fmi2CompletedIntegratorStep", in(continuous), true, &Walk::completed, Interface::exchange},
    {"fmi2SetTime", kExchange, true, &Walk::set_time, Interface::exchange},
    {"fmi2SetContinuousStates", in(continuous), true, &Walk::set_states, Interface::exchange},
    {"fmi2GetDerivatives", kRates, true, &Walk::get_derivatives, Interface::exchange},
    {"fmi2GetEventIndicators", kRates, true, &Walk::get_indicators, Interface::exchange},
    {"fmi2GetContinuousStates", kRates, true, &Walk::get_states, Interface::exchange},
    {"fmi2GetNominalsOfContinuousStates", in(instantiated) | kRates, true, &Walk::get_nominals, Interface::exchange},
};

}  // namespace host
