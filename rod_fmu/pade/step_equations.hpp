// The equations of one step of backward Euler on the grid, in the units of node.hpp: length L, force EA = F, time h.
#pragma once

#include "pade/grid_rod.hpp"

namespace rod {

using pade::TcaVector;
using pade::Vector3;
using pade::Vector6;

/// Equations of one step, in their own units.
struct GridRod::StepEquations {
  pade::ScaledSection section;
  Vector6 row_scale;              // of the balance of momentum
  Vector3 tip_moment, tip_force;  // in the frame of the tip before the step
  double length, force;           // units [m, N]
  bool inside;
  TcaVector delta_guess, reference_length;
  PerTca<double> T;
  TcaVector N_before;  // tensions and tip load of the step before, minus those of this step at its start
  Vector3 moment_before, force_before;
  double withheld;                // share of this jump that is not applied
  TcaVector delta_before, delta;  // delta is an unknown beside z
  TcaVector N, N_slope;
};

}  // namespace rod
