// Level `full`: every node of the mesh is a state, in mass-orthonormal coordinates x = mass^(1/2) (T - T_0), so that
//     x' = -A x + B w,   A = mass^(-1/2) stiffness mass^(-1/2) sparse and symmetric.
// A one-step L-stable Runge-Kutta method (SUNDIALS' ARKODE) with sparse direct factors of A + 1/gamma, kept while gamma
// stays. It starts afresh with every call, so its memory is x and the step length to try first.
#pragma once

#include <memory>

#include "heat_level.hpp"
#include "heat_matrices.hpp"

namespace thermal {

class FullLevel final : public HeatLevel {
 public:
  FullLevel(const HeatMatrices& matrices, const Parameters& parameters);
  ~FullLevel() override;

  std::size_t state_size() const override;
  int unknowns() const override;
  void advance(std::span<double> state, const Drive& drive, double h, double tolerance) override;
  Observation observe(std::span<const double> state, const Drive& drive) override;

 private:
  struct Integrator;
  std::unique_ptr<Integrator> integrator_;
};

}  // namespace thermal
