// The TCAs as resistors: R_i = R_ref,i [1 + alpha_T (T_i - T_ref) + beta delta_i / L], P_i = V_i^2 / R_i.
#pragma once

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>

#include "parameters.hpp"

namespace thermal {

class Circuit {
 public:
  explicit Circuit(const Parameters& p)
      : tca_(p.tca), T_0_(p.T_0), length_(p.body.length), has_feedback_(p.has_feedback()) {}

  bool has_feedback() const { return has_feedback_; }

  /// [ohm]; not positive where the linear law has left its range.
  double resistance(std::size_t i, double rise, double delta) const {
    return tca_.R[i] * (1.0 + tca_.alpha_T * (T_0_ + rise - tca_.T_ref) + tca_.beta * delta / length_);
  }

  /// [W]; throws std::domain_error where the resistance is not positive or the power is beyond all doubles.
  double power(std::size_t i, double voltage, double rise, double delta) const {
    const double ohm = has_feedback_ ? resistance(i, rise, delta) : tca_.R[i];
    if (!(ohm > 0.0)) refuse(i, rise, delta);
    const double watt = voltage * voltage / ohm;
    if (!std::isfinite(watt)) {
      throw std::domain_error("the power of TCA " + std::to_string(i + 1) +
                              " is beyond all numbers; reduce the voltage");
    }
    return watt;
  }

  [[noreturn]] void refuse(std::size_t i, double rise, double delta) const {
    std::ostringstream text;
    text << "the resistance of TCA " << i + 1 << " is " << resistance(i, rise, delta) << " ohm at " << T_0_ + rise
         << " K and delta = " << delta << " m, it must be positive; reduce tca.alpha_T or tca.beta, or the voltage";
    throw std::domain_error(text.str());
  }

 private:
  Tca tca_;
  double T_0_, length_;
  bool has_feedback_;
};

}  // namespace thermal
