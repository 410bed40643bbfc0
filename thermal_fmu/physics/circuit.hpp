// The TCAs as resistors (Joule heat, Eq. 2):
//     R_i = R_ref,i [1 + alpha_T,i (T_i - T_ref) + beta_i delta_i / L], P_i = V_i^2 / R_i.
#pragma once

#include <cmath>
#include <sstream>
#include <string>

#include "core/status.hpp"
#include "physics/parameters.hpp"

namespace thermal {

class Circuit {
 public:
  explicit Circuit(const Parameters& p)
      : tca_(p.tca), T_0_(p.T_0), length_(p.body.length), has_feedback_(p.has_feedback()) {}

  std::size_t count() const { return tca_.count; }

  bool has_feedback() const { return has_feedback_; }

  /// [ohm]; not positive where the linear law has left its range.
  double resistance(std::size_t i, double rise, double delta) const {
    return tca_.R[i] * (1.0 + tca_.alpha_T[i] * (T_0_ + rise - tca_.T_ref) + tca_.beta[i] * delta / length_);
  }

  /// [ohm/K]
  double resistance_per_kelvin(std::size_t i) const { return tca_.R[i] * tca_.alpha_T[i]; }

  /// Writes the power [W]. Fails where the resistance is not positive or the power is not finite.
  core::Status power(std::size_t i, double voltage, double rise, double delta, double& watt) const {
    const double ohm = has_feedback_ ? resistance(i, rise, delta) : tca_.R[i];
    if (!(ohm > 0.0)) return not_positive(i, rise, delta);
    watt = voltage * voltage / ohm;
    if (!std::isfinite(watt))
      return core::Status::discard("the power of TCA " + std::to_string(i + 1) + " is not finite",
                                   "reduce the voltage");
    return {};
  }

  /// A resistance below this share of its reference value heats without bound (R -> 0, P = V^2/R): named a blow-up.
  static constexpr double kBlowUp = 0.05;

  /// Names the resistance that has vanished or is about to at these rises [K] and displacements [m]; success where none
  /// is the cause of powers that do not settle.
  template <class Rises, class Deltas>
  core::Status explain(const Rises& rise, const Deltas& delta) const {
    if (!has_feedback_) return {};
    for (std::size_t i = 0; i < tca_.count; ++i) {
      const double ohm = resistance(i, rise[i], delta[i]);
      if (!(ohm > 0.0)) return not_positive(i, rise[i], delta[i]);
      if (ohm > kBlowUp * tca_.R[i] || tca_.alpha_T[i] > 0.0) continue;  // one that rises with the heat recovers
      std::ostringstream what;
      what << "blow-up: the resistance of TCA " << i + 1 << " tends to 0 (" << ohm << " ohm at " << T_0_ + rise[i]
           << " K and delta = " << delta[i] << " m, " << tca_.R[i]
           << " ohm at tca.T_ref), its power grows without bound";
      return core::Status::discard(what.str(), "reduce tca.alpha_T or tca.beta, or the voltage");
    }
    return {};
  }

  /// The failure of a resistance that is not positive at this temperature rise [K] and displacement [m].
  core::Status not_positive(std::size_t i, double rise, double delta) const {
    std::ostringstream what;
    what << "blow-up: the resistance of TCA " << i + 1 << " is " << resistance(i, rise, delta) << " ohm at "
         << T_0_ + rise << " K and delta = " << delta << " m, it must be positive";
    return core::Status::discard(what.str(), "reduce tca.alpha_T or tca.beta, or the voltage");
  }

 private:
  Tca tca_;
  double T_0_, length_;
  bool has_feedback_;
};

}  // namespace thermal
