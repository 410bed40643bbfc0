// The parameters of the heat problem of one cross-section, times the body's length. Defaults: the set `fig3`.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/capacity.hpp"

namespace thermal {

using core::kMaxTcas;

/// One value per TCA; those from the number of TCAs on are not used.
using PerTca = std::array<double, kMaxTcas>;

/// Evenly spread azimuths 2 pi i / N [rad].
constexpr PerTca even_azimuths(std::size_t count) {
  PerTca azimuth{};
  for (std::size_t i = 0; i < count; ++i)
    azimuth[i] = 6.283185307179586 * static_cast<double>(i) / static_cast<double>(count);
  return azimuth;
}

constexpr PerTca filled(double value) {
  PerTca all{};
  all.fill(value);
  return all;
}

enum class Level : int { lumped = 1, reduced = 2, full = 3 };
enum class ConvectionKind : int { constant = 1, free = 2, forced = 3 };

struct Body {
  double radius = 5e-3;    // [m]
  double length = 40e-3;   // [m]
  double k = 0.19;         // conductivity [W/(m K)]
  double rho_c = 0.669e6;  // heat capacity [J/(m3 K)]
  bool operator==(const Body&) const = default;
};

/// The TCAs, each with values of its own.
struct Tca {
  std::size_t count = core::kDefaultTcas;              // of those that there are
  PerTca outer_radius = filled(0.85e-3);               // [m]
  PerTca inner_radius = filled(0.2e-3);                // radius of the bore [m]
  PerTca offset = filled(2.5e-3);                      // from the body's axis to the TCA's axis [m]
  PerTca azimuth = even_azimuths(core::kDefaultTcas);  // [rad]
  PerTca k = filled(0.19);                             // [W/(m K)]
  PerTca rho_c = filled(0.969e6);                      // [J/(m3 K)]
  PerTca R = filled(6.9);                              // resistance at T_ref and delta = 0 [ohm]
  PerTca alpha_T{};                                    // relative change of resistance with temperature [1/K]
  PerTca beta{};                                       // relative change of resistance with strain delta/length [1]
  double T_ref = 298.15;                               // temperature at which R holds [K]
  bool operator==(const Tca&) const = default;
};

struct Parameters {
  Parameters() = default;
  /// Start values at that number of TCAs, evenly spread; thinner ones where the usual ones would not fit side by side.
  explicit Parameters(std::size_t tcas) {
    constexpr double kShare = 0.9;  // of the radius at which neighbours touch
    tca.count = tcas;
    tca.azimuth = even_azimuths(tcas);
    const double touching = tca.offset[0] * std::sin(3.141592653589793 / static_cast<double>(tcas));
    if (tcas > 1) tca.outer_radius = filled(std::min(tca.outer_radius[0], kShare * touching));
  }

  Body body;
  Tca tca;
  ConvectionKind convection = ConvectionKind::constant;
  double h = 20.0;      // heat transfer at the outer circle where convection is constant [W/(m2 K)]
  double T_0 = 298.15;  // uniform temperature at the start [K]
  Level level = Level::reduced;
  double tolerance = 1e-5;  // error of temperature rises, relative to the steady rise of a heated TCA [1]
  bool operator==(const Parameters&) const = default;

  /// Whether all but the circuit of the TCAs is the same.
  bool has_same_section(Parameters other) const {
    other.tca.R = tca.R, other.tca.alpha_T = tca.alpha_T, other.tca.beta = tca.beta, other.tca.T_ref = tca.T_ref;
    return other == *this;
  }

  bool has_feedback() const {
    const auto acts = [&](const PerTca& values) {
      return std::any_of(values.begin(), values.begin() + tca.count, [](double each) { return each != 0.0; });
    };
    return acts(tca.alpha_T) || acts(tca.beta);
  }
};

}  // namespace thermal
