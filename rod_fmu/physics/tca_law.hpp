// Law of a twisted-and-coiled actuator (Eq. 4, corrected), N the tension:
//   delta = f1 N + chi f2 tau(T),   hence   N = (delta - chi f2 tau(T))/f1
//   f1 = l [R^2 cos^2 a/(G J) + R^2 sin^2 a/(E I) + sin^2 a/(E A) + cos^2 a/(G A)]   compliance [m/N]
//   f2 = l R cos a/(G J)                                                             [1/N]
//   tau = G J phi0 (1 - d0/d)/l,  d = d0 (1 + rho_T (T - T_0)),  phi0 = 2 pi twists  untwisting torque [N m]
//   R = l cos a/(2 pi n)  radius of the coil [m],  sin a = L/l,  J = pi d^4/32,  I = J/2,  A = pi d^2/4,  G = E/3
// with the wire's length l [m], diameter d [m] and number of coils n, pitch angle a, and chirality chi (+1: extends
// when heated). From Castigliano's theorem; the paper's f2 misses a factor of 2 (8 for 16). The free stroke is f2 tau =
// R cos a phi0 (1 - d0/d). The pitch angle stays at its reference value (pitch = frozen), or follows the displacement,
// delta = l (sin a - sin a0) (pitch = current), which makes the law nonlinear.
#pragma once

#include "physics/data.hpp"

namespace rod {

/// Tension [N] and its derivatives in displacement [N/m] and temperature [N/K].
struct Tension {
  double value, per_delta, per_T;
};

class TcaLaw {
 public:
  TcaLaw() = default;
  explicit TcaLaw(const Parameters& p);

  /// Tension at displacement delta [m] and temperature T [K]; NaN where delta exceeds what the wire's length allows.
  Tension tension(double delta, double T) const;
  /// Displacement of the unloaded TCA of reference pitch at T [K], chi f2 tau(T) [m].
  double free_stroke(double T) const;
  /// Potential of the tension at displacement delta [m] and temperature T [K], N^2/(2 k) for the linear law [J].
  double energy(double delta, double T) const;
  /// 1/f1 at the reference pitch [N/m].
  double stiffness() const { return stiffness_; }

 private:
  /// For sin a = x: free stroke over its value at the reference pitch, compliance f1 [m/N], and their derivatives in x.
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
  double wire_ = 0.0, sin_a0_ = 0.0;  // wire length l [m], sine of the reference pitch angle
  // Terms of f1 without their powers of sin a and cos a [m/N]: l (R/cos a)^2/(G J), l (R/cos a)^2/(E I), l/(E A), l/(G
  // A)
  double torsion_ = 0.0, bending_ = 0.0, axial_ = 0.0, shear_ = 0.0;
};

}  // namespace rod
