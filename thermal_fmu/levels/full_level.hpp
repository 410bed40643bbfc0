// Level `full`: all nodes of the mesh, by a one-step L-stable Runge-Kutta method (SUNDIALS' ARKODE). It starts afresh
// with every call, so its memory is x and the step length to try first.
//
// Compared with CVODE's BDF on the same factors by `bench_thermal integrators`: BDF needs its history, which is not a
// state that can be restored; begun anew in every step, as rollback makes it, it is slower and misses the tolerance.
#pragma once

#include <memory>

#include "levels/full_system.hpp"

namespace thermal {

class FullLevel final : public HeatLevel {
 public:
  FullLevel(const HeatMatrices& matrices, const Parameters& parameters);
  ~FullLevel() override;

  std::size_t state_size() const override;
  int unknowns() const override;
  Status advance(std::span<double> state, const Drive& drive, double h, double tolerance) override;
  void retune(const Parameters& parameters) override;
  Status observe(std::span<const double> state, const Drive& drive, Observation& seen) override;
  double max_rise(std::span<const double> state) override;
  bool exceeds(std::span<const double> state, double rise) override;

  const FullSystem::Counts& counts() const;

 private:
  struct Integrator;
  std::unique_ptr<Integrator> integrator_;
};

}  // namespace thermal
