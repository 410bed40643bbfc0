// Eq. 4 (corrected) and its derivatives; see the header for the symbols.
#include "physics/tca_law.hpp"

#include <cmath>
#include <numbers>

#include "numerics/quadrature.hpp"

namespace rod {

TcaLaw::TcaLaw(const Tca& tca, double span, double T_0)
    : law_(tca.law), pitch_(tca.pitch), expansion_(tca.rho_T), T_0_(T_0), wire_(tca.wire_length) {
  using std::numbers::pi;
  if (law_ == Law::measured) {
    stiffness_ = tca.stiffness, stiffening_ = tca.stiffening;
    gain_ = tca.chirality * tca.stroke, gain_slope_ = tca.chirality * tca.stroke_curvature;
    creep_compliance_ = tca.creep_compliance, creep_time_ = tca.creep_time, creep_activation_ = tca.creep_activation;
    stop_ = tca.stop, stop_width_ = tca.stop_width, stop_stiffness_ = tca.stop_stiffness;
    return;
  }
  const double d = tca.wire_diameter, E = tca.E, G = E / 3.0;
  const double A = pi * d * d / 4.0, J = pi * std::pow(d, 4) / 32.0, I = J / 2.0;
  const double radius = wire_ / (2.0 * pi * tca.coils);  // of the coil over cos a: R/cos a
  torsion_ = wire_ * radius * radius / (G * J);
  bending_ = wire_ * radius * radius / (E * I);
  axial_ = wire_ / (E * A);
  shear_ = wire_ / (G * A);
  sin_a0_ = span / wire_;
  stiffness_ = 1.0 / coil(sin_a0_).f1;
  gain_ = tca.chirality * radius * (1.0 - sin_a0_ * sin_a0_) * 2.0 * pi * tca.twists;
  const double sine = sin_a0_, cosine_2 = 1.0 - sine * sine;  // R = radius cos a
  handedness_ = tca.handedness;
  coupling_ = wire_ * radius * cosine_2 * sine * (1.0 / (G * J) - 1.0 / (E * I));
  twist_compliance_ = wire_ * (sine * sine / (G * J) + cosine_2 / (E * I));
  free_twist_ = sine / (radius * cosine_2);
}

TcaLaw::Coil TcaLaw::coil(double x) const {
  const double c2 = 1.0 - x * x, c2_0 = 1.0 - sin_a0_ * sin_a0_;  // cos^2 a; R cos a is radius * cos^2 a
  return {.stroke = c2 / c2_0,
          .stroke_slope = -2.0 * x / c2_0,
          .f1 = torsion_ * c2 * c2 + bending_ * c2 * x * x + axial_ * x * x + shear_ * c2,
          .f1_slope = 2.0 * x * (-2.0 * torsion_ * c2 + bending_ * (1.0 - 2.0 * x * x) + axial_ - shear_)};
}

double TcaLaw::free_stroke(double T) const {
  if (law_ == Law::measured) return (gain_ + gain_slope_ * (T - T_0_)) * (T - T_0_);
  const double growth = expansion_ * (T - T_0_);  // d = d0 (1 + growth), so 1 - d0/d = growth/(1 + growth)
  return gain_ * growth / (1.0 + growth);
}

double TcaLaw::stroke_slope(double T) const {
  if (law_ == Law::measured) return gain_ + 2.0 * gain_slope_ * (T - T_0_);
  const double growth = 1.0 + expansion_ * (T - T_0_);
  return gain_ * expansion_ / (growth * growth);
}

Tension TcaLaw::tension(double delta, double T) const {
  const double stroke = free_stroke(T), slope = stroke_slope(T);
  if (law_ == Law::measured) return measured_tension(delta, T);
  if (pitch_ == Pitch::frozen) return {stiffness_ * (delta - stroke), stiffness_, -stiffness_ * slope};
  const double x = sin_a0_ + delta / wire_;
  if (!(std::abs(x) < 1.0)) return {NAN, NAN, NAN};
  const Coil c = coil(x);
  const double N = (delta - c.stroke * stroke) / c.f1;
  return {N, (1.0 - (c.stroke_slope * stroke + c.f1_slope * N) / wire_) / c.f1, -c.stroke * slope / c.f1};
}

TetheredForce TcaLaw::tethered(double delta, double phi, double T) const {
  const double f1 = 1.0 / stiffness_, c = coupling_, f3 = twist_compliance_, h = handedness_;
  const double determinant = f1 * f3 - c * c;
  const double stretch = delta - free_stroke(T), turn = h * phi - free_twist_ * free_stroke(T);
  const double slope = stroke_slope(T);
  return {.N = (f3 * stretch - c * turn) / determinant,
          .Q = h * (f1 * turn - c * stretch) / determinant,
          .N_delta = f3 / determinant,
          .N_phi = -h * c / determinant,
          .Q_phi = f1 / determinant,
          .N_T = slope * (c * free_twist_ - f3) / determinant,
          .Q_T = h * slope * (c - f1 * free_twist_) / determinant};
}

double TcaLaw::tethered_energy(double delta, double phi, double T) const {
  const TetheredForce force = tethered(delta, phi, T);
  return 0.5 * (force.N * (delta - free_stroke(T)) + force.Q * (phi - handedness_ * free_twist_ * free_stroke(T)));
}

namespace {

/// The one-sided h(u) of the contact of coils, its derivative and its integral.
struct Touch {
  double value, slope, integral;
};
Touch coil_contact(double u) {
  if (u <= -1.0) return {0.0, 0.0, 0.0};
  if (u >= 1.0) return {u, 1.0, 0.1 + 0.5 * u * u};
  const double s = u + 1.0, s2 = s * s;
  return {s2 * s * (3.0 - u) / 16.0, s2 * (2.0 - u) / 4.0, s2 * s2 * (1.0 - 0.2 * s) / 16.0};
}

}  // namespace

Tension TcaLaw::measured_tension(double delta, double T) const {
  Tension tension{};
  if (creeps()) {
    const Extension e = extension(delta, T);
    const double slope = stiffness_ + 2.0 * stiffening_ * e.x;
    tension = {(stiffness_ + stiffening_ * e.x) * e.x, slope * e.per_delta, slope * e.per_T};
  } else {
    const double x = delta - free_stroke(T), slope = stiffness_ + 2.0 * stiffening_ * x;
    tension = {(stiffness_ + stiffening_ * x) * x, slope, -slope * stroke_slope(T)};
  }
  if (stop_stiffness_ != 0.0) {
    const auto touch = coil_contact((stop_ - delta) / stop_width_);
    tension.value -= stop_stiffness_ * stop_width_ * touch.value;
    tension.per_delta += stop_stiffness_ * touch.slope;
  }
  return tension;
}

double TcaLaw::measured_energy(double delta, double T) const {
  const double x = creeps() ? extension(delta, T).x : delta - free_stroke(T);
  const double z = creeps() ? delta - free_stroke(T) - x : 0.0;
  const double crept = creeps() ? 0.5 * z * z / creep_compliance_ : 0.0;
  const double touch = coil_contact((stop_ - delta) / stop_width_).integral;
  return (0.5 * stiffness_ + stiffening_ * x / 3.0) * x * x + stop_stiffness_ * stop_width_ * stop_width_ * touch +
         crept;
}

double TcaLaw::creep_time(double T) const { return creep_time_ * std::exp(creep_activation_ * (1.0 / T - 1.0 / T_0_)); }

/// With e = delta - stroke and s = span/tau the creep z = e - x solves z (1 + s) - base = s J (k1 x + k2 x^2), in x
///   s J k2 x^2 + (1 + s + s J k1) x - ((1 + s) e - base) = 0,
/// of which the root counts that goes through x = 0.
TcaLaw::Extension TcaLaw::extension(double delta, double T) const {
  const double e = delta - free_stroke(T), s = creep_span_ / creep_time(T), J = creep_compliance_;
  const double a = s * J * stiffening_, b = 1.0 + s + s * J * stiffness_, c = (1.0 + s) * e - creep_base_;
  const double x = 2.0 * c / (b + std::sqrt(b * b + 4.0 * a * c));  // NaN beyond the largest compression of the spring
  const double slope = b + 2.0 * a * x;
  const double per_e = (1.0 + s) / slope;
  const double excess = J * (stiffness_ + stiffening_ * x) * x - (e - x);  // J N - z
  const double s_per_T = s * creep_activation_ / (T * T);
  return {x, per_e, -per_e * stroke_slope(T) - excess / slope * s_per_T};
}

TcaLaw::Creep TcaLaw::creep(double delta, double T) const {
  const double x = extension(delta, T).x, z = delta - free_stroke(T) - x, tau = creep_time(T);
  const double rate = (creep_compliance_ * (stiffness_ + stiffening_ * x) * x - z) / tau;
  return {z, rate, tau / creep_compliance_ * rate * rate, -(stiffness_ + 2.0 * stiffening_ * x)};
}

double TcaLaw::energy(double delta, double T) const {
  if (law_ == Law::measured) return measured_energy(delta, T);
  // int_0^delta N, above the energy of the TCA that is held at its reference length.
  const Quadrature& grid = quadrature(kMaxOrder);
  double work = 0.0;
  for (int k = 0; k < grid.nodes; ++k) work += grid.w[k] * delta * tension(grid.s[k] * delta, T).value;
  const double stroke = free_stroke(T);
  return work + 0.5 * stiffness_ * stroke * stroke;
}

}  // namespace rod
