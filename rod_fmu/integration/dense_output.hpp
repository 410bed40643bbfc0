// Internal steps across communication points. While all inputs are constant, an internal step need not end at a
// communication point: it ends where the tolerance lets it, and the host sees its dense output, a polynomial. Changed
// inputs discard the part of such a step that lies ahead.
#pragma once

#include "integration/integrator.hpp"

namespace rod {

struct InputCourse {
  bool are_constant = false;   // the inputs are constant during this communication step
  bool are_as_before = false;  // and equal those of the communication step before
};

/// Records the loads of this communication step in the state.
InputCourse record_inputs(const Inputs& u, State& state);

/// Moves the state by `elapsed` [s], less than state.time_ahead, towards state.ahead: on the polynomial of degree 5
/// that agrees with both in strains and their two rates; the dissipated energy on the cubic that agrees in value and
/// power.
void interpolate_to(const Rod& rod, double elapsed, State& state);

}  // namespace rod
