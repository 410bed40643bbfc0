// Law of a twisted-and-coiled actuator (Eq. 4, corrected), N the tension:
//   delta = f1 N + chi f2 tau(T),   hence   N = (delta - chi f2 tau(T))/f1
//   f1 = l [R^2 cos^2 a/(G J) + R^2 sin^2 a/(E I) + sin^2 a/(E A) + cos^2 a/(G A)]   compliance [m/N]
//   f2 = l R cos a/(G J)                                                             [1/N]
//   tau = G J phi0 (1 - d0/d)/l,  d = d0 (1 + rho_T (T - T_0)),  phi0 = 2 pi twists  untwisting torque [N m]
//   R = l cos a/(2 pi n)  radius of the coil [m],  sin a = L/l,  J = pi d^4/32,  I = J/2,  A = pi d^2/4,  G = E/3
// with the wire's length l [m], diameter d [m] and number of coils n, pitch angle a, and chirality chi (+1: extends
// when heated). From Castigliano's theorem; the paper's f2 misses a factor of 2 (8 for 16). The free stroke is f2 tau =
// R cos a phi0 (1 - d0/d). The pitch angle stays at its reference value (pitch = frozen), or follows the displacement,
// delta = l (sin a - sin a0) (pitch = current), which makes the law nonlinear. L is the length of the TCA's span.
//
// A measured TCA (law = measured) has, with dT = T - T_0 and x = delta - chi (c1 dT + c2 dT^2),
//   N = k1 x + k2 x^2 - k_s w h((stop - delta)/w)
// where h(u) is 0 below u = -1, u above 1 and twice differentiable between: the coils touch at delta = stop, where the
// contact sets in over the width w. All of it derives from a potential.
//
// Creep (creep_compliance J > 0) puts a Kelvin element in series with that spring: x = delta - chi (c1 dT + c2 dT^2) -
// z,
//   dz/dt = (J N_x - z)/tau,   tau = tau_0 exp(Q (1/T - 1/T_0)),   N_x = k1 x + k2 x^2 the tension of the spring.
// With the potential z^2/(2 J) it dissipates tau/J (dz/dt)^2. Where the coils touch they carry their part of N beside
// it. An implicit step asks for the tension that goes with z = base + span dz/dt; span = 0 is that of the moment.
#pragma once

#include "physics/data.hpp"

namespace rod {

/// Tension [N] and its derivatives in displacement [N/m] and temperature [N/K].
struct Tension {
  double value, per_delta, per_T;
};

/// Tension [N] and torque [N m] of a TCA whose ends do not turn, and their derivatives in displacement, rotation of the
/// ends about the TCA [rad] and temperature.
struct TetheredForce {
  double N = 0.0, Q = 0.0;
  double N_delta = 0.0, N_phi = 0.0, Q_phi = 0.0;  // the stiffness is symmetric
  double N_T = 0.0, Q_T = 0.0;
};

class TcaLaw {
 public:
  TcaLaw() = default;
  /// Law of a TCA whose span in the straight body is this long [m]; T_0 is the temperature of zero stroke [K].
  TcaLaw(const Tca& tca, double span, double T_0);
  /// Law of TCA i of a body.
  TcaLaw(const Parameters& p, std::size_t i) : TcaLaw(p.tca[i], p.span_of(i), p.T_0) {}

  /// Tension at displacement delta [m] and temperature T [K]; NaN where delta exceeds what the wire's length allows.
  Tension tension(double delta, double T) const;
  /// Displacement of the unloaded TCA of reference pitch at T [K], chi f2 tau(T) [m].
  double free_stroke(double T) const;
  /// Potential of the tension at displacement delta [m] and temperature T [K], N^2/(2 k) for the linear law [J].
  double energy(double delta, double T) const;
  /// Tension and torque of a TCA whose ends the body holds: with both end loads in Castigliano's theorem
  ///   delta = f1 N + c Q + chi f2 tau,   h phi = c N + f3 Q + chi l sin a/(G J) tau,
  ///   c = l R sin a cos a (1/(G J) - 1/(E I)),   f3 = l (sin^2 a/(G J) + cos^2 a/(E I)),
  /// with the handedness h of the coil and the rotation phi [rad] of its ends about the TCA. Wire law, frozen pitch.
  TetheredForce tethered(double delta, double phi, double T) const;
  /// Potential of both [J].
  double tethered_energy(double delta, double phi, double T) const;
  /// Whether the tension is 0 at every displacement and temperature: a measured TCA without any stiffness.
  bool is_slack() const {
    return law_ == Law::measured && stiffness_ == 0.0 && stiffening_ == 0.0 && stop_stiffness_ == 0.0 && !creeps();
  }
  /// 1/f1 at the reference pitch [N/m].
  double stiffness() const { return stiffness_; }

  /// Creep of the moment [m], its rate [m/s], the power that it dissipates [W], and the tension's change by z [N/m].
  struct Creep {
    double z, rate, power, tension_per_z;
  };
  bool creeps() const { return creep_compliance_ != 0.0; }
  double creep_compliance() const { return creep_compliance_; }
  /// Sets what the law knows of the creep: z = base + span dz/dt [m, s].
  void set_creep(double base, double span) { creep_base_ = base, creep_span_ = span; }
  Creep creep(double delta, double T) const;

 private:
  /// For sin a = x: free stroke over its value at the reference pitch, compliance f1 [m/N], and their derivatives in x.
  struct Coil {
    double stroke, stroke_slope, f1, f1_slope;
  };
  Coil coil(double x) const;
  double stroke_slope(double T) const;
  Tension measured_tension(double delta, double T) const;
  double measured_energy(double delta, double T) const;
  /// Extension of the spring [m] and its derivatives in displacement and temperature [m/K].
  struct Extension {
    double x, per_delta, per_T;
  };
  Extension extension(double delta, double T) const;
  double creep_time(double T) const;

  Law law_ = Law::wire;
  Pitch pitch_ = Pitch::frozen;
  double stiffness_ = 0.0;
  double gain_ = 0.0;                           // wire: chi R cos(a0) phi0 [m]; measured: chi stroke [m/K]
  double expansion_ = 0.0;                      // rho_T [1/K]
  double stiffening_ = 0.0, gain_slope_ = 0.0;  // k2 [N/m2], chi c2 [m/K2]
  double stop_ = 0.0, stop_width_ = 1.0, stop_stiffness_ = 0.0;                // m, m, N/m
  double creep_compliance_ = 0.0, creep_time_ = 1.0, creep_activation_ = 0.0;  // m/N, s, K
  double creep_base_ = 0.0, creep_span_ = 0.0;                                 // m, s; set before every use
  double T_0_ = 0.0;
  double wire_ = 0.0, sin_a0_ = 0.0;  // wire length l [m], sine of the reference pitch angle
  // Terms of f1 without their powers of sin a and cos a [m/N]: l (R/cos a)^2/(G J), l (R/cos a)^2/(E I), l/(E A), l/(G
  // A)
  double handedness_ = 1.0;
  double coupling_ = 0.0, twist_compliance_ = 0.0;  // c [1/N], f3 [1/(N m)]
  double free_twist_ = 0.0;                         // free rotation over free stroke, tan a/R [rad/m]
  double torsion_ = 0.0, bending_ = 0.0, axial_ = 0.0, shear_ = 0.0;
};

}  // namespace rod
