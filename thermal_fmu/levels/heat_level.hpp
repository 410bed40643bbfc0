// One level of the heat model, whatever its size: what drives it, what is seen of it, how it advances.
// Its state is a vector of doubles owned by the caller; a level itself keeps only scratch that follows from its
// arguments.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "core/status.hpp"
#include "core/time_polynomial.hpp"
#include "physics/parameters.hpp"

namespace thermal {

using core::Cubic;
using core::Status;

struct Drive {
  std::array<Cubic, kTcas> V{};      // [V]
  std::array<Cubic, kTcas> delta{};  // [m]
  Cubic ambient_rise{};              // T_ambient - T_0 [K]
};

struct Observation {
  PerTca rise{};              // T_i - T_0 [K]
  PerTca rate{};              // dT_i/dt [K/s]
  PerTca power{};             // [W]
  double loss = 0.0;          // through the surface [W]
  double stored = 0.0;        // since the uniform T_0 [J]
  double max_rise = 0.0;      // in TCAs and on the surface [K]
  double surface_rise = 0.0;  // mean [K]
  double bound = 0.0;         // no T_i was further than this from the same mesh unreduced, given the powers so far [K]
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
  /// What is seen at the start of the drive.
  virtual Status observe(std::span<const double> state, const Drive& drive, Observation& seen) = 0;

  // The same level as differential equations, where it is small enough to be shown: amplitudes of its modes, as rises
  // in kelvin that a uniform one is spread over.

  /// How many; 0: not shown.
  virtual std::size_t amplitudes() const { return 0; }
  virtual void get_amplitudes(std::span<const double> /*state*/, std::span<double> /*x*/) const {}
  virtual void set_amplitudes(std::span<double> /*state*/, std::span<const double> /*x*/) const {}
  /// Their rates at the start of the drive [K/s].
  virtual Status rates(std::span<const double> /*state*/, const Drive&, std::span<double> /*dx*/) { return {}; }
  /// Counts the way of the powers since they were last looked at towards Observation::bound.
  virtual Status note_powers(std::span<double> /*state*/, const Drive&) { return {}; }
};

}  // namespace thermal
