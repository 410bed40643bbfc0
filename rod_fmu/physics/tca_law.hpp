// The twisted-and-coiled actuator's law, tension positive (Eq. 4 with the factor 16 of Castigliano's theorem):
//   delta = f1 N + chi f2 tau(T),  N = (delta - chi f2 tau(T))/f1.
// f1 and f2 depend on the coils' pitch angle a. It is held at its reference value, or follows the displacement,
// delta = l (sin a - sin a0), which makes the law nonlinear.
#pragma once

#include "physics/data.hpp"

namespace rod {

/// A tension [N] and its slopes in displacement [N/m] and temperature [N/K].
struct Tension {
  double value, per_delta, per_T;
};

class TcaLaw {
 public:
  TcaLaw() = default;
  explicit TcaLaw(const Parameters& p);

  /// Tension at displacement delta [m] and temperature T [K]; not finite where the wire would have to be longer than it
  /// is.
  Tension tension(double delta, double T) const;
  /// Displacement of the unloaded TCA of reference pitch at T [K], chi f2 tau(T) [m].
  double free_stroke(double T) const;
  /// Potential of the tension at displacement delta [m] and temperature T [K], N^2/(2 k) for the linear law [J].
  double energy(double delta, double T) const;
  /// 1/f1 at the reference pitch [N/m].
  double stiffness() const { return stiffness_; }

 private:
  /// Free stroke over its value at the reference pitch, compliance f1 [m/N], and their slopes in sin a, for sin a = x.
  struct Coil {
    double stroke, stroke_slope, f1, f1_slope;
  };
  Coil coil(double x) const;
  double stroke_slope(double T) const;

  Law law_ = Law::wire;
  Pitch pitch_ = Pitch::frozen;
  double stiffness_ = 0.0;
  double gain_ = 0.0;       // wire: chi R cos(a0) phi0 [m]; measured: chi stroke [m/K]
  double expansion_ = 0.0;  // rho_T [1/K]
  double T_0_ = 0.0;
  double wire_ = 0.0, x_0_ = 0.0;                                     // l [m], sin a0
  double torsion_ = 0.0, bending_ = 0.0, axial_ = 0.0, shear_ = 0.0;  // l (l/(2 pi n))^2/GJ and /EI, l/EA, l/GA [m/N]
};

}  // namespace rod
