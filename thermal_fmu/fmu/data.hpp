// What the thermal FMU's variables point to: parameters, inputs (value and three derivatives), outputs.
#pragma once

#include "model/model.hpp"
#include "physics/parameters.hpp"

namespace thermal {

/// Number of amplitudes that model exchange shows at that number of TCAs.
constexpr std::size_t most_amplitudes(std::size_t tcas) { return 24 * (tcas + 1); }

struct Data {
  Data() = default;
  explicit Data(std::size_t tcas) : parameters(tcas) {}

  Parameters parameters;

  // Inputs.
  std::array<fmu::Polynomial, kMaxTcas> V{};         // [V]
  std::array<fmu::Polynomial, kMaxTcas> delta{};     // [m]
  fmu::Polynomial T_ambient{298.15, 0.0, 0.0, 0.0};  // [K]
  fmu::Polynomial air_speed{};                       // [m/s]

  // Outputs and their rates.
  PerTca T = filled(298.15);     // [K]
  PerTca T_rate = filled(0.0);   // [K/s]
  PerTca P = filled(0.0);        // [W]
  double Q_loss = 0.0;           // [W]
  double E_stored = 0.0;         // [J]
  double T_max = 298.15;         // [K]
  double T_surface = 298.15;     // [K]
  double coefficient = 20.0;     // [W/(m2 K)]
  double reduction_bound = 0.0;  // [K]
  double reduction_states = 0.0;
};

}  // namespace thermal
