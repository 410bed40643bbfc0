// Interface of a level of the heat model: inputs (Drive), outputs (Observation), time step.
// The state is a vector of doubles owned by the caller; a level keeps only scratch that follows from its arguments.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "core/status.hpp"
#include "core/time_polynomial.hpp"
#include "core/unwritten.hpp"
#include "physics/parameters.hpp"

namespace thermal {

using core::Cubic;
using core::Status;

/// Arrays over TCAs: the first `count` of the parameters are used.
struct Drive {
  std::array<Cubic, kMaxTcas> V{};      // [V]
  std::array<Cubic, kMaxTcas> delta{};  // [m]
  Cubic ambient_rise{};                 // T_ambient - T_0 [K]
  Cubic air_speed{};                    // [m/s]
};

/// By which a field may exceed its hottest node [K]; 0.014 at the start values.
inline constexpr double kBetweenNodes = 0.1;

/// What a level does not write stays core::kUnwritten.
struct Observation {
  PerTca rise = filled(core::kUnwritten);   // T_i - T_0 [K]
  PerTca rate = filled(core::kUnwritten);   // dT_i/dt [K/s]
  PerTca power = filled(core::kUnwritten);  // [W]
  double loss = core::kUnwritten;           // through the surface [W]
  double stored = core::kUnwritten;         // since the uniform T_0 [J]
  double surface_rise = core::kUnwritten;   // mean [K]
  double coefficient = core::kUnwritten;    // of heat transfer at the surface [W/(m2 K)]
  double bound = core::kUnwritten;          // of the error of every T_i so far against the same mesh unreduced [K]
};

class HeatLevel {
 public:
  virtual ~HeatLevel() = default;

  /// Doubles in the state, all of them zero at the uniform temperature T_0.
  virtual std::size_t state_size() const = 0;
  /// Unknown temperatures or amplitudes.
  virtual int unknowns() const = 0;
  /// From the start of the drive to `h` [s] later. `tolerance` matters where time is not exact. Fails when a resistance
  /// stops being positive or the integrator cannot go on; the state is then unspecified.
  virtual Status advance(std::span<double> state, const Drive& drive, double h, double tolerance) = 0;
  /// Takes over the parameters of the circuit; all others are those of the construction.
  virtual void retune(const Parameters& parameters) = 0;
  /// Writes the outputs at the start of the drive.
  virtual Status observe(std::span<const double> state, const Drive& drive, Observation& seen) = 0;
  /// Highest rise in TCAs and on the surface [K].
  virtual double max_rise(std::span<const double> state) = 0;
  /// Returns whether max_rise() exceeds `rise` [K]; cheap where it is far below.
  virtual bool exceeds(std::span<const double> state, double rise) = 0;

  // The level as differential equations, for model exchange: amplitudes of its modes [K], scaled so that a uniform rise
  // of 1 K has amplitudes whose squares sum to 1.

  /// Number of amplitudes; 0 where the level is not offered in this form.
  virtual std::size_t amplitudes() const { return 0; }
  virtual void get_amplitudes(std::span<const double> /*state*/, std::span<double> /*x*/) const {}
  virtual void set_amplitudes(std::span<double> /*state*/, std::span<const double> /*x*/) const {}
  /// Refuses amplitudes that no heating reaches: temperatures below absolute zero, or far beyond any material.
  virtual Status check_amplitudes(std::span<const double> /*state*/) const { return {}; }
  /// Their rates at the start of the drive [K/s].
  virtual Status rates(std::span<const double> /*state*/, const Drive&, std::span<double> /*dx*/) { return {}; }
  /// Adds the change of the powers since the last call to what Observation::bound is proportional to.
  virtual Status note_powers(std::span<double> /*state*/, const Drive&) { return {}; }
};

}  // namespace thermal
