// The twisted-and-coiled actuator's law, tension positive (Eq. 4 with the factor 16 of Castigliano's theorem):
//   delta = f1 N + chi f2 tau(T),  N = (delta - chi f2 tau(T))/f1.
#pragma once

#include "data.hpp"

namespace rod {

/// A tension [N] and its slopes in displacement [N/m] and temperature [N/K].
struct Tension {
  double value, per_delta, per_T;
};

class TcaLaw {
 public:
  TcaLaw() = default;
  explicit TcaLaw(const Parameters& p);

  /// Tension at displacement delta [m] and temperature T [K].
  Tension tension(double delta, double T) const;
  /// Displacement of the unloaded TCA at T [K], chi f2 tau(T) [m].
  double free_stroke(double T) const;
  /// Energy N^2/(2 k) at displacement delta [m] and temperature T [K], the potential of the tension [J].
  double energy(double delta, double T) const;

  double stiffness = 0.0;  // 1/f1 [N/m]

 private:
  double stroke_slope(double T) const;

  Law law_ = Law::wire;
  double gain_ = 0.0;       // wire: chi R cos(a) phi0 [m]; measured: chi stroke [m/K]
  double expansion_ = 0.0;  // rho_T [1/K]
  double T_0_ = 0.0;
};

}  // namespace rod
