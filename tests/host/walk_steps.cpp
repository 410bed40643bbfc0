// Calls of co-simulation and of model exchange.
#include <cmath>
#include <cstring>

#include "walk.hpp"

namespace host {

fmi2Status Walk::step() {
  const double h = is_bad_ ? (chance(0.5) ? -1.0 : std::nan("")) : std::pow(10.0, uniform(-4.0, -1.0));
  const fmi2Status status = fmu_.DoStep(instance_, time_, h, fmi2True);
  if (is_bad_ || !(in(mode_)&kSlave)) return status;
  double reached = 0.0;
  if (status == fmi2Error) {
    mode_ = broken;
  } else {
    mode_ = status == fmi2Discard ? failed : running;
    expect(fmu_.GetRealStatus(instance_, fmi2LastSuccessfulTime, &reached) == fmi2OK, "no last successful time");
    expect(reached >= time_ && reached <= time_ + h * (1 + 1e-9), "the last successful time is not in the step");
    time_ = reached;
  }
  return status;
}

fmi2Status Walk::cancel() { return fmu_.CancelStep(instance_); }

int Walk::kind() { return static_cast<int>(pick(4)) - (chance(0.1) ? 7 : 0); }

fmi2Status Walk::answered(fmi2Status status) {
  if (is_slave_ && (in(mode_) & (kSlave | in(terminated))))
    expect(status == fmi2OK || status == fmi2Discard, "an inquiry is neither answered nor discarded");
  return status;
}

// On purpose outside of the enumeration, which UBSan would end here.
[[gnu::no_sanitize("enum")]] fmi2StatusKind Walk::any_kind() {
  const int number = kind();
  fmi2StatusKind result{};
  std::memcpy(&result, &number, sizeof number);
  return result;
}

fmi2Status Walk::get_status() {
  fmi2Status value = fmi2OK;
  return answered(fmu_.GetStatus(instance_, any_kind(), &value));
}

fmi2Status Walk::get_real_status() {
  double value = 0.0;
  return answered(fmu_.GetRealStatus(instance_, any_kind(), &value));
}

fmi2Status Walk::get_integer_status() {
  int value = 0;
  return answered(fmu_.GetIntegerStatus(instance_, any_kind(), &value));
}

fmi2Status Walk::get_boolean_status() {
  int value = 0;
  return answered(fmu_.GetBooleanStatus(instance_, any_kind(), &value));
}

fmi2Status Walk::get_string_status() {
  fmi2String value = nullptr;
  return answered(fmu_.GetStringStatus(instance_, any_kind(), &value));
}

fmi2Status Walk::event_mode() {
  const fmi2Status status = fmu_.EnterEventMode(instance_);
  if (status == fmi2OK) mode_ = event;
  return status;
}

fmi2Status Walk::new_states() {
  fmi2EventInfo info{};
  return fmu_.NewDiscreteStates(instance_, is_bad_ ? nullptr : &info);
}

fmi2Status Walk::continuous_mode() { return moved(fmu_.EnterContinuousTimeMode(instance_), event, continuous); }

fmi2Status Walk::completed() {
  fmi2Boolean a = 0, b = 0;
  return fmu_.CompletedIntegratorStep(instance_, fmi2True, is_bad_ ? nullptr : &a, &b);
}

fmi2Status Walk::set_time() {
  const fmi2Status status = fmu_.SetTime(instance_, is_bad_ ? std::nan("") : time_ + 1e-4);
  if (status <= fmi2Warning) time_ += 1e-4;
  return status;
}

std::size_t Walk::room() { return description_.states.size() + (is_bad_ ? 1 : 0); }

fmi2Status Walk::set_states() {
  std::vector<double> x(room(), 0.0);
  for (double& each : x) each = uniform(-1e-3, 1e-3);
  if (chance(0.02)) x[0] = 1e200;
  return fmu_.SetContinuousStates(instance_, x.data(), x.size());
}

fmi2Status Walk::finite_numbers(fmi2Status (*function)(fmi2Component, fmi2Real*, size_t)) {
  std::vector<double> x(room(), 0.0);
  const fmi2Status status = function(instance_, x.data(), x.size());
  for (const double each : x) expect(status > fmi2Warning || std::isfinite(each), "a number is not finite");
  return status;
}

fmi2Status Walk::get_derivatives() { return finite_numbers(fmu_.GetDerivatives); }

fmi2Status Walk::get_states() { return finite_numbers(fmu_.GetContinuousStates); }

fmi2Status Walk::get_nominals() { return finite_numbers(fmu_.GetNominalsOfContinuousStates); }

fmi2Status Walk::get_indicators() {
  double z = 0.0;
  return fmu_.GetEventIndicators(instance_, &z, is_bad_ ? 1 : 0);
}

}  // namespace host
