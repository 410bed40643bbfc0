// Steps across communication points. While all inputs stand still, a step need not end where the host looks: it ends
// where the tolerance lets it, and the host sees points on its way. Moved inputs make the rest of such a step void.
#pragma once

#include "integration/integrator.hpp"

namespace rod {

/// The inputs stand still, and have since the communication step before. Takes note of them for the next one.
bool stand_still(const Inputs& u, State& state);

/// Moves the state `elapsed` seconds, less than state.left, towards what is ahead: on the polynomial of degree 5 that
/// has strains and both their rates in common with both; heat by the cubic with its powers.
void move_towards(const Rod& rod, double elapsed, State& state);

}  // namespace rod
