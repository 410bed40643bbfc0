// The rival of level `full`: the same equations by SUNDIALS' CVODE, variable-order BDF, with its history kept from
// step to step or begun anew in each, as a rolled-back co-simulation must.
#pragma once

#include "levels/full_system.hpp"
#include "levels/sundials.hpp"

namespace thermal {

class Bdf {
 public:
  Bdf(const HeatMatrices& matrices, const Parameters& parameters, bool keeps_history);
  ~Bdf();

  /// On by h [s] under a drive that does not change with time.
  void advance(const Drive& drive, double h, double tolerance);
  Observation observe(const Drive& drive);
  const FullSystem::Counts& counts() const { return system_.counts; }

 private:
  static int slope(sunrealtype t, N_Vector at, N_Vector out, void* user);
  static int solve(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, sunrealtype);

  FullSystem system_;
  Sundials sundials_;
  void* cvode_ = nullptr;
  const Drive* drive_ = nullptr;  // during advance only
  bool keeps_history_;
  double t_ = 0.0;  // [s]
};

}  // namespace thermal
