// Level `full`: every node of the mesh is a state, in mass-orthonormal coordinates x = mass^(1/2) (T - T_0), so that
//     x' = -A x + B w,   A = mass^(-1/2) stiffness mass^(-1/2) sparse and symmetric.
// A one-step L-stable Runge-Kutta method (SUNDIALS' ARKODE) with sparse direct factors of A + 1/gamma, kept while gamma
// stays. It starts afresh with every call, so its memory is x and the step length to try first.
//
// Compared with CVODE's BDF on the same factors (scene `step`, tolerance 1e-5, order 4, one core): in macro steps of 1
// s this method takes 42 ms for an error of 5e-5 K; BDF with its history kept 52 ms for 4e-5 K, but the history is not
// a state that can be restored; BDF begun anew at every macro step 140 ms for 8e-4 K. In macro steps of 0.1 s: 198 ms
// and 3e-6 K, 162 ms and 2e-5 K, 636 ms and 4e-3 K. A rolled-back co-simulation begins anew all the time: BDF was
// dropped.
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
