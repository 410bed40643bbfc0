// The cross-section cut into one cell per TCA: the power diagram of the TCAs' circles (Aurenhammer, SIAM J. Comput. 16
// (1987) 78), clipped by the rim. A point belongs to the TCA whose circle it has the least power of, |x - c|^2 - b^2.
//
// Cells are convex and each holds its circle, so rays from a TCA's axis meet the boundary of its cell once. For TCAs
// of one radius on one circle about the axis the cells are the sectors between bisectors.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace thermal {

struct Circle {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  // [m]
  double radius = 0.0;                               // [m]
};

/// A straight wall between the cells of two circles, from and to points that other walls or the rim share.
struct Wall {
  std::size_t first, second;  // the circles, first < second
  Eigen::Vector2d from, to;   // [m]
};

/// The walls between circles inside a rim about the origin. They do not overlap and lie inside the rim, at least
/// `gap` [m] from each other; ends closer than a part of the gap are one point.
std::vector<Wall> walls(const std::vector<Circle>& circles, double rim, double gap);

/// A stretch of the boundary of a cell: a wall, or the rim.
struct Side {
  Eigen::Vector2d from, to;  // [m]
  std::size_t wall;          // index of the wall, kRim for a stretch of the rim
  bool is_reversed = false;  // the wall's ends are the other way round
};
inline constexpr std::size_t kRim = static_cast<std::size_t>(-1);

/// The sides of the cell of circle `index`, counter-clockwise. Without walls, when it is the only circle: none.
std::vector<Side> cell_sides(const std::vector<Circle>& circles, const std::vector<Wall>& walls, std::size_t index);

}  // namespace thermal
