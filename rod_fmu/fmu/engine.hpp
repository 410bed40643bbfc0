// Interface between the FMU's adapter and a discretisation of the rod with its integrators. An engine keeps nothing but
// scratch; all that survives a step is in the memory handed to it.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "core/status.hpp"
#include "integration/integrator.hpp"
#include "physics/data.hpp"
#include "physics/loads.hpp"

namespace rod {

class Engine {
 public:
  virtual ~Engine() = default;

  /// Evaluations of the residual of the whole rod so far, whatever function asked for them.
  virtual long evaluations() const = 0;

  /// Number of doubles of the memory below.
  virtual std::size_t memory_size() const = 0;
  /// Sets the memory to the unloaded rod at rest.
  virtual void set_unloaded(std::span<double> memory) = 0;
  /// Puts the rod at rest at the equilibrium of the loads, starting from its present shape. On failure the memory is
  /// unchanged.
  virtual core::Status solve_equilibrium(std::span<double> memory, const Loads& loads) = 0;
  /// Advances by h [s]; tolerance is relative. On failure the memory belongs to `reached` of the outcome.
  virtual StepOutcome step(std::span<double> memory, const Inputs& u, double h, double tolerance) = 0;
  /// Refuses strains and rates that no motion of this rod reaches.
  virtual core::Status check_motion(std::span<double> /*memory*/) const { return {}; }
  /// Writes energy_dissipated and these parts of the outputs but for `clamp`. is_same: memory and loads are those of
  /// the last call of this function.
  virtual void outputs(std::span<double> memory, const Loads& loads, unsigned parts, bool is_same, Outputs& y) = 0;

  /// Forgets what an integrator knows beyond the present point of the motion; the parameters have changed.
  virtual void discard_look_ahead(std::span<double> /*memory*/) const {}

  /// Writes force and moment of the clamp on the rod.
  virtual core::Status clamp_reaction(std::span<double> memory, const Loads& loads, Outputs& y) = 0;

  /// Shortest step [s] whose motion this discretisation resolves after a sudden load.
  virtual double least_resolved_step() const { return 0.0; }

  /// Doubt about the last equilibrium that solve_equilibrium() or a static step() found; empty if there is none.
  virtual std::string doubt() const { return ""; }

  /// Writes the time derivative of the memory at rest in the equilibrium of loads that change at `change`. False: not
  /// offered, or singular.
  virtual bool equilibrium_rate(std::span<double> /*memory*/, const Loads&, const Loads& /*change*/,
                                std::span<double> /*rate*/) {
    return false;
  }

  // Continuous states, for engines that integrate differential equations: strains in the order of Rod::to_states, their
  // rates likewise, dissipated energy. Coefficients that this rod lacks are 0.
  virtual void get_states(std::span<double> /*memory*/, std::span<double> /*x*/) const {}
  virtual void set_states(std::span<double> /*memory*/, std::span<const double> /*x*/) const {}
  /// Writes the time derivatives of the states; the memory stays as it is.
  virtual core::Status rates(std::span<const double> /*memory*/, const Loads&, std::span<double> /*dx*/) {
    return core::Status::error("this discretisation has no continuous states");
  }
  /// Writes the derivative of rates() in the direction dx of the states and `change` of the loads. False: not offered,
  /// or not finite.
  virtual bool rates_along(std::span<const double> /*memory*/, const Loads&, const Loads& /*change*/,
                           std::span<const double> /*dx*/, std::span<double> /*ddx*/) {
    return false;
  }
};

/// Strain polynomials: statics, and all methods but the paper's.
std::unique_ptr<Engine> make_strain_engine(const Parameters& p);
/// The paper's scheme on grid points (Eqs. 21-25), dynamics only.
std::unique_ptr<Engine> make_grid_engine(const Parameters& p);

}  // namespace rod
