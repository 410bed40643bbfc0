#include "tca.hpp"

#include <cmath>
#include <numbers>

namespace rod {

TcaLaw::TcaLaw(const Parameters& p) : law_(p.tca_law), expansion_(p.tca_rho_T), T_0_(p.T_0) {
  using std::numbers::pi;
  if (p.tca_law == Law::measured) {
    stiffness = p.tca_stiffness;
    gain_ = p.tca_chirality * p.tca_stroke;
    return;
  }
  const double l = p.tca_wire_length, d = p.tca_wire_diameter;
  const double sin_a = p.body_length / l, cos_a = std::sqrt(1.0 - sin_a * sin_a);
  const double R = l * cos_a / (2.0 * pi * p.tca_coils);
  const double A = pi * d * d / 4.0, J = pi * std::pow(d, 4) / 32.0, I = J / 2.0;
  const double E = p.tca_E, G = E / 3.0;
  const double f1 = l * (R * R * cos_a * cos_a / (G * J) + R * R * sin_a * sin_a / (E * I) + sin_a * sin_a / (E * A) +
                         cos_a * cos_a / (G * A));
  stiffness = 1.0 / f1;
  gain_ = p.tca_chirality * R * cos_a * 2.0 * pi * p.tca_twists;
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
  return {stiffness * (delta - free_stroke(T)), stiffness, -stiffness * stroke_slope(T)};
}

double TcaLaw::energy(double delta, double T) const {
  const double stretch = delta - free_stroke(T);
  return 0.5 * stiffness * stretch * stretch;
}

}  // namespace rod
