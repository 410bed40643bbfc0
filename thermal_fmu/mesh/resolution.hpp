// Chooses the order of the elements by what it does to the answer: response of every T_i to every channel, steady and
// at real frequencies up to 1e5 times the slowest rate, compared between one order and the next.
#pragma once

#include "mesh/heat_matrices.hpp"
#include "mesh/heat_section.hpp"

namespace thermal {

inline constexpr int kLeastOrder = 3, kHighestOrder = 10;

/// The section at the lowest order whose responses are off by at most `tolerance` of the reference rise, or at
/// kHighestOrder; what they are off by is estimated in `error`. An order is accepted by the change of the steady
/// response to the next order, or, where the tolerance is loose, by its change from the order before and a cautious
/// ratio of changes. Fails as heat_matrices does.
core::Result<HeatSection> resolved_section(const Parameters& parameters);

/// The undivided matrices at an order that was found so.
core::Result<HeatMatrices> matrices_of(const HeatSection& section, const Parameters& parameters);

/// Both at once.
core::Result<HeatMatrices> resolved_matrices(const Parameters& parameters);

}  // namespace thermal
