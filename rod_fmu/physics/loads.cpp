#include "physics/loads.hpp"

namespace rod {

namespace {

double value(const Polynomial& u, double s) { return u[0] + s * (u[1] + s * (u[2] / 2.0 + s * u[3] / 6.0)); }
double rate(const Polynomial& u, double s) { return u[1] + s * (u[2] + s * u[3] / 2.0); }

template <class Evaluate>
Loads collect(const Inputs& u, Evaluate at) {
  const auto triad = [&at](const std::array<Polynomial, 3>& p) { return Vec3{at(p[0]), at(p[1]), at(p[2])}; };
  Loads loads{.gravity = triad(u.gravity), .tip_force = triad(u.tip_force), .tip_moment = triad(u.tip_moment)};
  for (std::size_t i = 0; i < tca_count; ++i) {
    loads.T[i] = at(u.T[i]);
    loads.delta_guess[i] = at(u.delta_guess[i]);
  }
  return loads;
}

}  // namespace

Loads Loads::seen_from(const Frame& frame) const {
  Loads turned = *this;
  turned.gravity = frame.in(gravity);
  turned.tip_force = frame.in(tip_force);
  turned.tip_moment = frame.in(tip_moment);
  return turned;
}

Loads loads_at(const Inputs& u, double elapsed) {
  return collect(u, [elapsed](const Polynomial& p) { return value(p, elapsed); });
}

Loads load_rates_at(const Inputs& u, double elapsed) {
  return collect(u, [elapsed](const Polynomial& p) { return rate(p, elapsed); });
}

}  // namespace rod
