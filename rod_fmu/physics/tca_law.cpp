// Eq. 4 (corrected) and its derivatives; see the header for the symbols.
#include "physics/tca_law.hpp"

#include <cmath>
#include <numbers>

#include "numerics/quadrature.hpp"

namespace rod {

TcaLaw::TcaLaw(const Parameters& p)
    : law_(p.tca_law), pitch_(p.tca_pitch), expansion_(p.tca_rho_T), T_0_(p.T_0), wire_(p.tca_wire_length) {
  using std::numbers::pi;
  if (p.tca_law == Law::measured) {
    stiffness_ = p.tca_stiffness;
    gain_ = p.tca_chirality * p.tca_stroke;
    return;
  }
  const double d = p.tca_wire_diameter, E = p.tca_E, G = E / 3.0;
  const double A = pi * d * d / 4.0, J = pi * std::pow(d, 4) / 32.0, I = J / 2.0;
  const double radius = wire_ / (2.0 * pi * p.tca_coils);  // of the coil over cos a: R/cos a
  torsion_ = wire_ * radius * radius / (G * J);
  bending_ = wire_ * radius * radius / (E * I);
  axial_ = wire_ / (E * A);
  shear_ = wire_ / (G * A);
  sin_a0_ = p.body_length / wire_;
  stiffness_ = 1.0 / coil(sin_a0_).f1;
  gain_ = p.tca_chirality * radius * (1.0 - sin_a0_ * sin_a0_) * 2.0 * pi * p.tca_twists;
}

TcaLaw::Coil TcaLaw::coil(double x) const {
  const double c2 = 1.0 - x * x, c2_0 = 1.0 - sin_a0_ * sin_a0_;  // cos^2 a; R cos a is radius * cos^2 a
  return {.stroke = c2 / c2_0,
          .stroke_slope = -2.0 * x / c2_0,
          .f1 = torsion_ * c2 * c2 + bending_ * c2 * x * x + axial_ * x * x + shear_ * c2,
          .f1_slope = 2.0 * x * (-2.0 * torsion_ * c2 + bending_ * (1.0 - 2.0 * x * x) + axial_ - shear_)};
}

double TcaLaw::free_stroke(double T) const {
  if (law_ == Law::measured) return gain_ * (T - T_0_);
  const double growth = expansion_ * (T - T_0_);  // d = d0 (1 + growth), so 1 - d0/d = growth/(1 + growth)
  return gain_ * growth / (1.0 + growth);
}

double TcaLaw::stroke_slope(double T) const {
  if (law_ == Law::measured) return gain_;
  const double growth = 1.0 + expansion_ * (T - T_0_);
  return gain_ * expansion_ / (growth * growth);
}

Tension TcaLaw::tension(double delta, double T) const {
  const double stroke = free_stroke(T), slope = stroke_slope(T);
  if (law_ == Law::measured || pitch_ == Pitch::frozen)
    return {stiffness_ * (delta - stroke), stiffness_, -stiffness_ * slope};
  const double x = sin_a0_ + delta / wire_;
  if (!(std::abs(x) < 1.0)) return {NAN, NAN, NAN};
  const Coil c = coil(x);
  const double N = (delta - c.stroke * stroke) / c.f1;
  return {N, (1.0 - (c.stroke_slope * stroke + c.f1_slope * N) / wire_) / c.f1, -c.stroke * slope / c.f1};
}

double TcaLaw::energy(double delta, double T) const {
  // int_0^delta N, above the energy of the TCA that is held at its reference length.
  const Quadrature& grid = quadrature(kMaxOrder);
  double work = 0.0;
  for (int k = 0; k < grid.nodes; ++k) work += grid.w[k] * delta * tension(grid.s[k] * delta, T).value;
  const double stroke = free_stroke(T);
  return work + 0.5 * stiffness_ * stroke * stroke;
}

}  // namespace rod
