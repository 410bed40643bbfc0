// Quasi-static steps of a rod whose TCAs creep: the equilibrium depends on the creep z of each TCA, which follows its
// tension,
//   r(q, z, loads) = 0,   dz_i/dt = (J_i N_i - z_i)/tau_i      (physics/tca_law.hpp).
// Integrated by the singly diagonally implicit method of order 3 with three stages (Alexander 1977, SIAM J. Numer.
// Anal. 14(6), 1006-1021): L-stable, and its last stage is the end of the step, so that the equilibrium holds there. In
// each stage z is eliminated TCA by TCA; what remains is an equilibrium with a softer law. A formula of order 2 on the
// first two stages estimates the error.
#pragma once

#include <array>
#include <cstddef>

#include "integration/integrator.hpp"

namespace rod {

class CreepIntegrator {
 public:
  /// Advances the equilibrium and the creep z [m] of every TCA by h [s]. tolerance is relative. On failure both belong
  /// to `reached`.
  StepOutcome step(Rod& rod, const Inputs& u, double h, double tolerance, State& state, double* z, Scratch& scratch);

 private:
  static constexpr std::size_t kStages = 3;

  /// Attempts one internal step; its results are in end_, power_ and error_.
  core::Status attempt(Rod& rod, const Inputs& u, double start, double length, double tolerance, State& state,
                       const double* z, Scratch& scratch);

  std::array<PerTca<double>, kStages> rate_{};
  PerTca<double> end_{};
  double dissipated_ = 0.0, error_ = 0.0;  // J; over the tolerance
  Vector before_;
};

/// Sets the laws to the creep z of the moment.
inline void set_creep(Rod& rod, const double* z) {
  for (std::size_t i = 0; i < rod.tcas(); ++i) rod.set_creep(i, z[i], 0.0);
}

}  // namespace rod
