// A discretisation of the rod together with its integrators, behind one interface: what the model needs of it. An
// engine keeps no state of its own but scratch; all that survives a step is in the memory handed to it.
#pragma once

#include <memory>
#include <span>

#include "integration/integrator.hpp"
#include "physics/data.hpp"
#include "physics/loads.hpp"

namespace rod {

class Engine {
 public:
  virtual ~Engine() = default;

  /// Of the residual of the whole rod so far, whoever asked for them.
  virtual long evaluations() const = 0;

  /// Doubles in `memory` below.
  virtual std::size_t memory_size() const = 0;
  /// Unloaded and at rest.
  virtual void rest(std::span<double> memory) = 0;
  /// At rest at the equilibrium of the loads, from the present shape. False: not found, memory as it was.
  virtual bool settle(std::span<double> memory, const Loads& loads) = 0;
  /// Advances by h [s]; tolerance is relative. The state belongs to `reached` of the result.
  virtual Advance step(std::span<double> memory, const Inputs& u, double h, double tolerance) = 0;
  /// All outputs.
  virtual void outputs(std::span<double> memory, const Loads& loads, Outputs& y) = 0;

  /// The rate of memory at rest in the equilibrium of loads that change. False: not found.
  virtual bool drift(std::span<double> /*memory*/, const Loads&, const Loads& /*change*/, std::span<double> /*rate*/) {
    return false;
  }

  // Memory as continuous states and back, for engines that integrate differential equations: strains in the order of
  // Rod::to_states, their rates likewise, heat of the damping. What this rod lacks is left alone.
  virtual void get_states(std::span<double> /*memory*/, std::span<double> /*x*/) const {}
  virtual void set_states(std::span<double> /*memory*/, std::span<const double> /*x*/) const {}
  /// Time derivatives of the states; memory stays as it is. False: there are none that are finite.
  virtual bool rates(std::span<const double> /*memory*/, const Loads&, std::span<double> /*dx*/) { return false; }
  /// The derivative of these in the direction dx of the states and `change` of the loads.
  virtual bool rates_along(std::span<const double> /*memory*/, const Loads&, const Loads& /*change*/,
                           std::span<const double> /*dx*/, std::span<double> /*ddx*/) {
    return false;
  }
};

/// Strains as polynomials: statics, and all methods but the paper's.
std::unique_ptr<Engine> make_strain_engine(const Parameters& p);
/// The paper's scheme on grid points, dynamics only.
std::unique_ptr<Engine> make_grid_engine(const Parameters& p);

}  // namespace rod
