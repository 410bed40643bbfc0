// Chooses the order of the elements by what it does to the answer: response of every T_i to every channel, steady and
// at real frequencies up to 1e5 times the slowest rate, compared between one order and the next.
#pragma once

#include "mesh/heat_matrices.hpp"

namespace thermal {

inline constexpr int kLeastOrder = 3, kHighestOrder = 10;

/// Matrices of the lowest order after which further orders are expected to change responses by at most `tolerance` of
/// the reference rise, or of kHighestOrder; what is expected is in `error`. Fails as heat_matrices does.
core::Result<HeatMatrices> resolved_matrices(const Parameters& parameters);

}  // namespace thermal
