// Variable-order, variable-step BDF (SUNDIALS IDA) on the rod as a system of index 1, for comparison with the one-step
// methods. The history of a multistep method cannot be rolled back cheaply, so every step() restarts from its state at
// order one: a restored state gives the same result, and many short communication steps are expensive.
#pragma once

#include <memory>

#include "integration/integrator.hpp"

namespace rod {

class Bdf {
 public:
  /// For rods with this number of unknowns. Throws std::bad_alloc.
  explicit Bdf(int unknowns);
  ~Bdf();
  Bdf(Bdf&&) noexcept;
  Bdf& operator=(Bdf&&) noexcept;

  /// Advances by h [s] to a relative tolerance; on failure the state is unchanged.
  StepOutcome step(const Rod& rod, const Inputs& u, double h, double tolerance, State& state, Scratch& scratch);

 private:
  struct Problem;
  std::unique_ptr<Problem> problem_;
};

}  // namespace rod
