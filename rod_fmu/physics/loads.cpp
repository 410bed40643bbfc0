// Evaluation of the inputs' polynomials in time.
#include "physics/loads.hpp"

#include <algorithm>
#include <span>

namespace rod {

namespace {

template <class Evaluate>
Loads collect(const Inputs& u, Evaluate at) {
  const auto triad = [&at](const std::array<Polynomial, 3>& p) { return Vec3{at(p[0]), at(p[1]), at(p[2])}; };
  Loads loads{{.gravity = triad(u.gravity), .tip_force = triad(u.tip_force), .tip_moment = triad(u.tip_moment)}};
  for (std::size_t i = 0; i < u.tcas; ++i) {
    loads.T[i] = at(u.T[i]);
    loads.delta_guess[i] = at(u.delta_guess[i]);
  }
  for (std::size_t m = 0; m < u.stations; ++m) loads.load[m] = triad(u.load[m]);
  return loads;
}

}  // namespace

BodyLoads Loads::seen_from(const Frame& frame) const {
  return {frame.to_frame(gravity), frame.to_frame(tip_force), frame.to_frame(tip_moment)};
}

Loads loads_at(const Inputs& u, double elapsed) {
  return collect(u, [elapsed](const Polynomial& p) { return core::is_constant(p) ? p[0] : core::value(p, elapsed); });
}

bool are_constant(const Inputs& u) {
  const auto constant = [](const Polynomial& p) { return core::is_constant(p); };
  const auto all = [&](const auto& inputs) { return std::ranges::all_of(inputs, constant); };
  const auto first = [](const auto& inputs, std::size_t count) { return std::span(inputs).first(count); };
  return all(first(u.T, u.tcas)) && all(first(u.delta_guess, u.tcas)) && all(u.gravity) && all(u.tip_force) &&
         all(u.tip_moment) && std::ranges::all_of(first(u.load, u.stations), all);
}

PerTca<double> temperatures_at(const Inputs& u, double elapsed) {
  PerTca<double> T{};
  for (std::size_t i = 0; i < u.tcas; ++i) T[i] = core::value(u.T[i], elapsed);
  return T;
}

Loads load_rates_at(const Inputs& u, double elapsed) {
  return collect(u, [elapsed](const Polynomial& p) { return core::is_constant(p) ? 0.0 : core::rate(p, elapsed); });
}

}  // namespace rod
