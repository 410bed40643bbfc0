#include "fmu/energy_watch.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

namespace rod {

namespace {

constexpr double kRounding = 1e-9;  // of the largest part of the energy: smaller exchanges say nothing

/// Views into the memory.
struct Memory {
  explicit Memory(std::span<double> memory)
      : reference(memory[0]), potential(memory[1]), exchanged(memory[2]), loads(memory.data() + 3) {}
  double& reference;  // energy after the first step under the present loads [J]; infinity: unknown
  double& potential;  // its part that is not kinetic [J]
  double& exchanged;  // largest kinetic energy, or change of the potential one, since then [J]
  double* loads;      // kLoadCount numbers
};

/// Whether inputs stand still during a step that ends at these loads.
bool stand_still(const Inputs& u, const Loads& at_end) {
  if (are_constant(u)) return true;
  const Loads at_start = loads_at(u, 0.0), rates = load_rates_at(u, 0.0);
  const Loads none = [] {
    Loads zero;
    std::memset(static_cast<void*>(&zero), 0, sizeof zero);
    return zero;
  }();
  // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): plain doubles without padding, see kLoadCount
  return std::memcmp(&at_start, &at_end, sizeof(Loads)) == 0 && std::memcmp(&rates, &none, sizeof(Loads)) == 0;
}

/// Whether the loads have a potential that the outputs show: weight and a dead force at the tip.
bool are_conservative(const Loads& loads, std::size_t stations) {
  const auto is_zero = [](const Vec3& each) { return each.x == 0.0 && each.y == 0.0 && each.z == 0.0; };
  return is_zero(loads.tip_moment) && std::ranges::all_of(std::span(loads.load).first(stations), is_zero);
}

/// Methods of time integration that lose energy by their nature: only a gain is a fault of theirs.
bool is_dissipative(Method method) { return method == Method::backward_euler || method == Method::pade_euler; }

}  // namespace

bool EnergyWatch::applies_to(const Parameters& p) {
  if (!p.dynamic || p.closure != Closure::inside) return false;
  for (std::size_t j = 0; j < p.segments; ++j)
    if (p.segment[j].retardation != 0.0) return false;
  for (std::size_t i = 0; i < p.tcas; ++i)
    if (p.tca[i].law == Law::wire && p.tca[i].pitch == Pitch::current) return false;
  return true;
}

void EnergyWatch::restart(std::span<double> memory) {
  std::ranges::fill(memory, 0.0);
  Memory(memory).reference = std::numeric_limits<double>::infinity();
}

double EnergyWatch::drift(std::span<double> memory, const Parameters& p, const Inputs& u, const Loads& at_end,
                          const Outputs& y) {
  Memory now(memory);
  const double by_force =
      at_end.tip_force.x * y.tip_p[0] + at_end.tip_force.y * y.tip_p[1] + at_end.tip_force.z * y.tip_p[2];
  const double potential = y.energy_elastic + y.energy_tca + y.energy_gravity - by_force;
  const double energy = potential + y.energy_kinetic;
  const bool is_conservative = are_conservative(at_end, u.stations);
  // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): the same numbers to the last bit
  const bool is_same = std::isfinite(now.reference) && std::memcmp(now.loads, &at_end, sizeof(Loads)) == 0;
  if (!is_same || !stand_still(u, at_end) || !is_conservative) {
    now.reference = is_conservative ? energy : std::numeric_limits<double>::infinity();
    now.potential = potential;
    now.exchanged = y.energy_kinetic;
    std::memcpy(now.loads, &at_end, sizeof(Loads));
    return 0.0;
  }
  now.exchanged = std::max({now.exchanged, y.energy_kinetic, std::abs(potential - now.potential)});
  const double largest = std::max({std::abs(y.energy_elastic), std::abs(y.energy_tca), std::abs(y.energy_gravity),
                                   std::abs(by_force), y.energy_kinetic});
  if (!(now.exchanged > kRounding * largest)) return 0.0;
  const double share = (energy - now.reference) / now.exchanged;
  return is_dissipative(p.method) ? std::max(share, 0.0) : share;
}

}  // namespace rod
