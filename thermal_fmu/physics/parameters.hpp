// The parameters of the heat problem of one cross-section, times the body's length. Defaults: the set `fig3`.
#pragma once

#include <array>
#include <cstddef>

#ifndef TCA_COUNT
#define TCA_COUNT 3
#endif

namespace thermal {

inline constexpr std::size_t kTcas = TCA_COUNT;
static_assert(kTcas >= 1 && kTcas <= 6, "TCA_COUNT must lie in 1..6");

using PerTca = std::array<double, kTcas>;

/// Inputs of the linear heat problem: the power of each TCA [W], then the rise of the surroundings [K].
inline constexpr int kChannels = static_cast<int>(kTcas) + 1;

/// Evenly spread azimuths 2 pi i / N [rad].
constexpr PerTca even_azimuths() {
  PerTca azimuth{};
  for (std::size_t i = 0; i < kTcas; ++i) azimuth[i] = 6.283185307179586 * static_cast<double>(i) / kTcas;
  return azimuth;
}

constexpr PerTca filled(double value) {
  PerTca all{};
  all.fill(value);
  return all;
}

enum class Level : int { lumped = 1, reduced = 2, full = 3 };

struct Body {
  double radius = 5e-3;    // [m]
  double length = 40e-3;   // [m]
  double k = 0.19;         // conductivity [W/(m K)]
  double rho_c = 0.669e6;  // heat capacity [J/(m3 K)]
  bool operator==(const Body&) const = default;
};

struct Tca {
  double outer_radius = 0.85e-3;     // [m]
  double inner_radius = 0.2e-3;      // radius of the bore [m]
  double offset = 2.5e-3;            // from the body's axis to a TCA's axis [m]
  PerTca azimuth = even_azimuths();  // [rad]
  double k = 0.19;                   // [W/(m K)]
  double rho_c = 0.969e6;            // [J/(m3 K)]
  PerTca R = filled(6.9);            // resistance of each TCA at T_ref and delta = 0 [ohm]
  double alpha_T = 0.0;              // relative change of resistance with temperature [1/K]
  double beta = 0.0;                 // relative change of resistance with strain delta/length [1]
  double T_ref = 298.15;             // temperature at which R holds [K]
  bool operator==(const Tca&) const = default;
};

struct Parameters {
  Body body;
  Tca tca;
  double h = 20.0;      // heat transfer at the outer circle [W/(m2 K)]
  double T_0 = 298.15;  // uniform temperature at the start [K]
  Level level = Level::reduced;
  double tolerance = 1e-5;  // error of temperature rises, relative to the steady rise of a heated TCA [1]
  bool operator==(const Parameters&) const = default;

  /// Whether all but the circuit of the TCAs is the same.
  bool has_same_section(Parameters other) const {
    other.tca.R = tca.R, other.tca.alpha_T = tca.alpha_T, other.tca.beta = tca.beta, other.tca.T_ref = tca.T_ref;
    return other == *this;
  }

  bool has_feedback() const { return tca.alpha_T != 0.0 || tca.beta != 0.0; }
};

}  // namespace thermal
