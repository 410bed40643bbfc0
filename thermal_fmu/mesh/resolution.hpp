// Chooses the order of the elements by what it does to the answer: response of every T_i to every channel, steady and
// at real frequencies up to 1e5 times the slowest rate, compared between one order and the next.
#pragma once

#include "mesh/heat_matrices.hpp"

namespace thermal {

inline constexpr int kLeastOrder = 3, kHighestOrder = 10;

/// Matrices of the lowest order whose responses are off by at most `tolerance` of the reference rise, or of
/// kHighestOrder; what they are off by is estimated in `error`. An order is accepted by the change of the steady
/// response to the next order, or, where the tolerance is loose, by its change from the order before and a cautious
/// ratio of changes. Fails as heat_matrices does.
core::Result<HeatMatrices> resolved_matrices(const Parameters& parameters);

}  // namespace thermal
