#include "mesh/cells.hpp"

#include <algorithm>
#include <cmath>

namespace thermal {
namespace {

using Eigen::Vector2d;

constexpr double kSnap = 0.2;        // ends of walls closer than this share of the gap are one point
constexpr double kMostSnap = 0.02;   // and than this share of the smallest radius
constexpr double kRounding = 1e-12;  // of the rim's radius: walls shorter than that do not exist

/// The stretch [from, to] of the line point + t along that both cells have; empty where from > to.
struct Stretch {
  Vector2d point, along;
  double from, to;
};

/// Points of equal power to circles a and b, clipped by the rim.
Stretch radical_axis(const Circle& a, const Circle& b, double rim) {
  const Vector2d apart = b.centre - a.centre;
  const double distance = apart.norm();
  const Vector2d normal = apart / distance;
  const double way = 0.5 * (distance + (a.radius * a.radius - b.radius * b.radius) / distance);
  Stretch line{a.centre + way * normal, Vector2d(-normal.y(), normal.x()), 1.0, -1.0};
  const double middle = -line.point.dot(line.along);
  const double square = rim * rim - (line.point + middle * line.along).squaredNorm();
  if (!(square > 0.0)) return line;
  line.from = middle - std::sqrt(square);
  line.to = middle + std::sqrt(square);
  return line;
}

/// Leaves the part of the line where circle c does not have the least power.
void clip(Stretch& line, const Circle& a, const Circle& c) {
  // The power of a less that of c is linear: 2 x . (c - a) + |a|^2 - a.radius^2 - |c|^2 + c.radius^2 <= 0.
  const Vector2d slope = 2.0 * (c.centre - a.centre);
  const double constant = a.centre.squaredNorm() - a.radius * a.radius - c.centre.squaredNorm() + c.radius * c.radius;
  const double at_point = slope.dot(line.point) + constant, rate = slope.dot(line.along);
  // Parallel walls: all or nothing.
  if (std::abs(rate) < kRounding * slope.norm()) {
    if (at_point > 0.0) line.from = 1.0, line.to = -1.0;
  } else if (rate > 0.0) {
    line.to = std::min(line.to, -at_point / rate);
  } else {
    line.from = std::max(line.from, -at_point / rate);
  }
}

/// Moves points that are closer than `closeness` onto one of them: on the rim where one of them is.
void snap(std::vector<Wall>& walls, double rim, double closeness) {
  std::vector<Vector2d> points;
  const auto for_ends = [&](auto&& act) {
    for (const bool wants_rim : {true, false})
      for (Wall& wall : walls)
        for (Vector2d* end : {&wall.from, &wall.to})
          if ((end->norm() > rim - 1e-9 * rim) == wants_rim) act(*end);
  };
  for_ends([&](const Vector2d& end) {
    const auto is_near = [&](const Vector2d& point) { return (point - end).norm() < closeness; };
    if (std::none_of(points.begin(), points.end(), is_near)) points.push_back(end);
  });
  for (Wall& wall : walls)
    for (Vector2d* end : {&wall.from, &wall.to}) {
      const auto nearest = std::min_element(points.begin(), points.end(), [&](const Vector2d& a, const Vector2d& b) {
        return (a - *end).squaredNorm() < (b - *end).squaredNorm();
      });
      *end = *nearest;
    }
  std::erase_if(walls, [](const Wall& wall) { return wall.from == wall.to; });
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

std::vector<Wall> walls(const std::vector<Circle>& circles, double rim, double gap) {
  std::vector<Wall> result;
  double smallest = rim;
  for (const Circle& circle : circles) smallest = std::min(smallest, circle.radius);
  for (std::size_t i = 0; i < circles.size(); ++i)
    for (std::size_t j = i + 1; j < circles.size(); ++j) {
      Stretch line = radical_axis(circles[i], circles[j], rim);
      for (std::size_t k = 0; k < circles.size(); ++k)
        if (k != i && k != j) clip(line, circles[i], circles[k]);
      if (line.to - line.from > kRounding * rim)
        result.push_back({i, j, line.point + line.from * line.along, line.point + line.to * line.along});
    }
  snap(result, rim, std::max(kRounding * rim, std::min(kSnap * gap, kMostSnap * smallest)));
  return result;
}

std::vector<Side> cell_sides(const std::vector<Circle>& circles, const std::vector<Wall>& walls, std::size_t index) {
  const Vector2d& centre = circles[index].centre;
  std::vector<Side> sides;
  for (std::size_t w = 0; w < walls.size(); ++w) {
    const Wall& wall = walls[w];
    if (wall.first != index && wall.second != index) continue;
    const bool is_reversed = cross(wall.from - centre, wall.to - centre) < 0.0;
    sides.push_back(is_reversed ? Side{wall.to, wall.from, w, true} : Side{wall.from, wall.to, w, false});
  }
  const auto angle = [&](const Side& side) {
    const Vector2d seen = 0.5 * (side.from + side.to) - centre;
    return std::atan2(seen.y(), seen.x());
  };
  std::sort(sides.begin(), sides.end(), [&](const Side& a, const Side& b) { return angle(a) < angle(b); });
  std::vector<Side> closed;
  for (std::size_t k = 0; k < sides.size(); ++k) {
    closed.push_back(sides[k]);
    const Side& next = sides[(k + 1) % sides.size()];
    if (sides[k].to != next.from) closed.push_back({sides[k].to, next.from, kRim, false});
  }
  return closed;
}

}  // namespace thermal
