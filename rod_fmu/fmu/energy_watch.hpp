// Balance of energy of an undamped rod under constant loads, which no other check of a run sees: a time step or strain
// polynomials that do not resolve the motion create or lose energy.
#pragma once

#include <cstddef>
#include <span>

#include "integration/integrator.hpp"
#include "physics/data.hpp"
#include "physics/loads.hpp"

namespace rod {

/// Compares the energy after every communication step with that after the first one under the same loads. All that it
/// remembers are plain doubles in a memory handed to it, part of the state of a run.
class EnergyWatch {
 public:
  /// Whether energy is conserved by a rod of these parameters where its loads are: no damping, and tensions with a
  /// potential.
  static bool applies_to(const Parameters& p);

  /// Number of doubles of the memory below.
  static constexpr std::size_t memory_size() { return 3 + kLoadCount; }
  /// Forgets what is remembered.
  static void restart(std::span<double> memory);

  /// The change of the energy since the loads are constant, over what kinetic and potential energy have exchanged since
  /// [1]; 0 where that is unknown. y: outputs at the end of the step.
  static double drift(std::span<double> memory, const Parameters& p, const Inputs& u, const Loads& at_end,
                      const Outputs& y);
};

}  // namespace rod
