// Calls that get and set values and derivatives.
#include <cmath>
#include <limits>

#include "walk.hpp"

namespace host {

fmi2Status Walk::get_real() {
  fmi2ValueReference vr[2] = {reals_[pick(reals_.size())]->reference, reals_[pick(reals_.size())]->reference};
  double values[2] = {0.0, 0.0};
  if (is_bad_ && chance(0.5)) return fmu_.GetReal(instance_, vr, 2, nullptr);
  if (is_bad_) vr[1] = 1u << 20;
  const fmi2Status status = fmu_.GetReal(instance_, vr, 2, values);
  if (status <= fmi2Warning) expect(std::isfinite(values[0]) && std::isfinite(values[1]), "a value is not finite");
  return status;
}

template <class Function>
fmi2Status Walk::get_other(Function function, const char* type) {
  for (const Variable& v : description_.variables) {
    if (v.type != type) continue;
    const fmi2ValueReference vr = is_bad_ ? 1u << 20 : v.reference;
    int value = 0;
    return function(instance_, &vr, 1, &value);
  }
  return is_bad_ ? function(instance_, nullptr, 1, nullptr) : function(instance_, nullptr, 0, nullptr);
}

fmi2Status Walk::get_integer() { return get_other(fmu_.GetInteger, "Enumeration"); }

fmi2Status Walk::get_boolean() { return get_other(fmu_.GetBoolean, "Boolean"); }

fmi2Status Walk::get_string() { return fmu_.GetString(instance_, nullptr, is_bad_ ? 1 : 0, nullptr); }

fmi2Status Walk::set_string() { return fmu_.SetString(instance_, nullptr, is_bad_ ? 1 : 0, nullptr); }

fmi2Status Walk::set_integer() { return fmu_.SetInteger(instance_, nullptr, is_bad_ ? 1 : 0, nullptr); }

fmi2Status Walk::set_boolean() { return fmu_.SetBoolean(instance_, nullptr, is_bad_ ? 1 : 0, nullptr); }

fmi2Status Walk::set_real() {
  const Variable& v = *inputs_[pick(inputs_.size())];
  fmi2ValueReference vr[2] = {v.reference, v.reference};
  double values[2] = {plausible(v), plausible(v)};
  if (is_bad_) {
    if (chance(0.5))
      values[1] = chance(0.5) ? std::nan("") : std::numeric_limits<double>::infinity();
    else
      vr[1] = outputs_[pick(outputs_.size())]->reference;
  }
  return fmu_.SetReal(instance_, vr, 2, values);
}

fmi2Status Walk::set_derivatives() {
  const fmi2ValueReference vr = inputs_[pick(inputs_.size())]->reference;
  const int order = is_bad_ ? 4 : 1 + static_cast<int>(pick(3));
  const double value = chance(0.02) ? 1e300 : uniform(-0.1, 0.1);
  return fmu_.SetRealInputDerivatives(instance_, &vr, 1, &order, &value);
}

fmi2Status Walk::output_derivatives() {
  const fmi2ValueReference vr = is_bad_ ? inputs_[0]->reference : outputs_[pick(outputs_.size())]->reference;
  const int order = 1 + static_cast<int>(pick(2));
  double value = 0.0;
  const fmi2Status status = fmu_.GetRealOutputDerivatives(instance_, &vr, 1, &order, &value);
  if (status <= fmi2Warning) expect(std::isfinite(value), "a derivative is not finite");
  return status;
}

fmi2Status Walk::directional() {
  if (!is_bad_ && (in(mode_)&kRead) && chance(0.8)) return fmi2OK;  // the dearest call
  const fmi2ValueReference unknown = outputs_[pick(outputs_.size())]->reference, known = inputs_[0]->reference;
  const fmi2ValueReference bad = 1u << 20;
  const double seed = 1.0;
  double value = 0.0;
  const fmi2Status status =
      fmu_.GetDirectionalDerivative(instance_, is_bad_ ? &bad : &unknown, 1, &known, 1, &seed, &value);
  if (status <= fmi2Warning) expect(std::isfinite(value), "a directional derivative is not finite");
  return status;
}

}  // namespace host
