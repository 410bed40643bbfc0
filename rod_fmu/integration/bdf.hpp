// Variable-order, variable-step BDF (SUNDIALS' IDA) on the rod as a system of index 1, for comparison with the one-step
// methods. A multistep method's history cannot be rolled back cheaply, so every step() starts anew from its state at
// order one: honest after a restore, and the price of many short communication steps.
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

  /// Advances by h [s] to a relative tolerance; on failure the state is as it was.
  Advance step(const Rod& rod, const Inputs& u, double h, double tolerance, State& state, Scratch& scratch);

 private:
  struct Problem;
  std::unique_ptr<Problem> problem_;
};

}  // namespace rod
