// Sections that lose little heat: Bi = h R / k so small that the steady rise 1/(h S) of the whole section exceeds the
// differences inside it by orders of magnitude (S: area of the surface).
//
// Then (a) the steady rise says nothing about a run of finite length, so tolerances refer to `reference_rise` instead,
// and (b) stiffness^-1 loses the differences in the section to rounding: its relative error is 1e-14/Bi (measured).
// The steady temperature is therefore split into the mean of the surface, known exactly from the balance of heat, and
// the rise above it, from a system that stays well conditioned as h -> 0.
#pragma once

#include <Eigen/Core>

#include "mesh/heat_matrices.hpp"

namespace thermal {

/// A tolerance counts at most this many times the steady rise of a TCA above the surface; above 4 for no section whose
/// heat transfer matters (1.9 at the start values).
inline constexpr double kSurfaceShare = 4.0;

/// Rise [K/W] that tolerances and bounds of the TCA refer to, of its steady rise and its steady rise above the surface.
inline double reference_rise(double steady, double above_surface) {
  return steady > kSurfaceShare * above_surface ? kSurfaceShare * above_surface : steady;
}

/// True where the split is needed, from the same two numbers; also where rounding has spoiled them.
inline bool is_insulated(double steady, double above_surface) {
  constexpr double kMostRatio = 1e3;  // steady / above: rounding then costs 1e-14 * ratio, of the steady rise
  return !(steady > 0.0) || !(above_surface > 0.0) || !(steady <= kMostRatio * above_surface);
}

/// Steady temperatures less the mean of the surface, nodes x TCAs, for 1 W in each TCA [K/W]. Holds for every h > 0,
/// and where the uniform temperature is 1 at every unknown and the last load is the surface's.
Eigen::MatrixXd rises_above_surface(const HeatSystem& system);

}  // namespace thermal
