// Parameters and displacements that are allowed, and that no rod or TCA has: the host is warned.
#pragma once

#include <limits>
#include <string>

#include "physics/data.hpp"

namespace rod {

/// What is doubtful about the parameters; empty: nothing.
std::string doubt_parameters(const Parameters& p);

/// Range of a TCA's displacement [m] in which its coils are coils: at `shortest` they touch, at `longest` the wire is
/// straight. Without bounds where the law has no wire.
struct DisplacementRange {
  double shortest, longest;

  DisplacementRange() = default;
  DisplacementRange(const Parameters& p, std::size_t i);
  bool is_bounded() const { return shortest != -std::numeric_limits<double>::infinity(); }
  bool contains(double delta) const { return delta >= shortest && delta <= longest; }
};

/// What is doubtful about the displacement of TCA i, which is out of the range.
std::string doubt_displacement(const Parameters& p, std::size_t i, const DisplacementRange& range, double delta);

}  // namespace rod
