#include "mesh/cross_section.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <sstream>

#include "mesh/cells.hpp"

namespace thermal {
namespace {

using Eigen::Vector2d;
constexpr double kTurn = 2.0 * std::numbers::pi;
// Widest views of one piece from its TCA's axis [rad]: a bisector runs past the TCA closely and needs shorter ones than
// the rim (measured: these reach a given error with the fewest unknowns).
constexpr double kWidestBisectorView = 64.0 / 360.0 * kTurn;
constexpr double kWidestRimView = 100.0 / 360.0 * kTurn;
constexpr double kWidestRatio = 5.0;  // of the radii of one ring of an annulus
constexpr double kLeastGap = 1e-3;    // between circles, in TCA radii: thinner ligaments mesh badly

Vector2d on_circle(double radius, double angle) { return radius * Vector2d(std::cos(angle), std::sin(angle)); }
double angle_of(const Vector2d& v) { return std::atan2(v.y(), v.x()); }

/// The angle from `from` to `to`, counter-clockwise, in [0, 2 pi).
double turn(double from, double to) {
  const double angle = std::fmod(to - from, kTurn);
  return angle < 0.0 ? angle + kTurn : angle;
}

int pieces(double view, double widest) { return std::max(1, static_cast<int>(std::ceil(view / widest - 1e-9))); }

core::Status out_of_range(const std::string& name, double value, const std::string& range, const std::string& remedy) {
  std::ostringstream what;
  what << name << " is " << value << ", allowed is " << range;
  return core::Status::error(what.str(), remedy);
}

/// Ends of equal geometric rings between radii of the given ratio, as fractions of the way.
std::vector<double> graded(double ratio, double widest_ratio) {
  const int rings = std::max(1, static_cast<int>(std::ceil(std::log(ratio) / std::log(widest_ratio) - 1e-9)));
  std::vector<double> ends(rings + 1);
  for (int i = 0; i <= rings; ++i) ends[i] = (std::pow(ratio, static_cast<double>(i) / rings) - 1.0) / (ratio - 1.0);
  ends.back() = 1.0;
  return ends;
}

Vector2d axis_of(const Tca& tca, std::size_t i) { return on_circle(tca.offset[i], tca.azimuth[i]); }

/// Points along the bisector between two neighbours, from the axis to the rim, evenly spread in angle as seen from
/// either TCA: the two are mirror images, so they agree on the points.
std::vector<Vector2d> bisector(const Body& body, double offset, double azimuth, double gap) {
  const Vector2d axis = on_circle(offset, azimuth);
  const double direction = azimuth + 0.5 * gap;
  const Vector2d rim = on_circle(body.radius, direction);
  const double first = angle_of(-axis);
  const double view = kTurn - turn(first, angle_of(rim - axis));
  std::vector<Vector2d> points{Vector2d::Zero()};
  const int n = pieces(view, kWidestBisectorView);
  const Vector2d along = on_circle(1.0, direction);
  for (int i = 1; i < n; ++i) {
    const Vector2d ray = on_circle(1.0, first - view * i / n);
    // axis + a ray = r along
    const double r = (axis.x() * ray.y() - axis.y() * ray.x()) / (along.x() * ray.y() - along.y() * ray.x());
    points.push_back(r * along);
  }
  points.push_back(rim);
  return points;
}

/// Arcs of the rim between two of its points, evenly spread in angle as seen from the TCA's axis.
std::vector<Curve> rim_arcs(const Body& body, const Vector2d& axis, double from, double to) {
  const double first = angle_of(on_circle(body.radius, from) - axis);
  double view = turn(first, angle_of(on_circle(body.radius, to) - axis));
  if (to - from > kTurn - 1e-9) view = kTurn;  // the only TCA: once round
  const int n = pieces(view, kWidestRimView);
  std::vector<double> ends{from};
  for (int i = 1; i < n; ++i) {
    const Vector2d ray = on_circle(1.0, first + view * i / n);
    const double b = axis.dot(ray);
    const double a = -b + std::sqrt(b * b + body.radius * body.radius - axis.squaredNorm());
    ends.push_back(ends.back() + turn(ends.back(), angle_of(axis + a * ray)));
  }
  ends.push_back(to);
  std::vector<Curve> arcs;
  for (int i = 0; i < n; ++i) arcs.push_back(Curve::arc(Vector2d::Zero(), body.radius, ends[i], ends[i + 1]));
  return arcs;
}

/// Ends of the ruled rings, as fractions of the way from the TCA's circle to the sector's boundary: two, and finer ones
/// at the circle where the body around a TCA of little heat capacity matters from a thin layer on, or where a TCA is so
/// thin that a ring would span more than kWidestRatio of radii (the field goes as the logarithm of the radius).
std::vector<double> ruled_rings(const Body& body, const Tca& tca, std::size_t i) {
  constexpr double kFirst = 0.33, kFiner = 5.0, kThinnest = 1e-4;
  const double b = tca.outer_radius[i], a = tca.inner_radius[i];
  const double layer =
      tca.rho_c[i] * (b * b - a * a) / (2.0 * b * body.rho_c);  // of body with a TCA's heat capacity [m]
  std::vector<double> ends{1.0, kFirst};
  const double reach = body.radius / b - 1.0;  // longest way, in radii of the TCA
  while ((ends.back() * b > 3.0 * layer || ends.back() * reach > kWidestRatio) && ends.back() > kThinnest)
    ends.push_back(ends.back() / kFiner);
  ends.push_back(0.0);
  return {ends.rbegin(), ends.rend()};
}

/// One piece of a cell: annulus and ruled rings between the TCA's axis and a stretch of the cell's boundary.
void add_piece(const Body& body, const Tca& tca, std::size_t i, const Curve& boundary, bool is_at_surface,
               std::vector<Patch>& patches) {
  const Vector2d axis = axis_of(tca, i);
  const double inner = tca.inner_radius[i], outer = tca.outer_radius[i];
  const double from = angle_of(boundary.at(-1.0) - axis);
  const double to = from + turn(from, angle_of(boundary.at(1.0) - axis));
  const Curve bore = Curve::arc(axis, inner, from, to);
  const Curve circle = Curve::arc(axis, outer, from, to);
  const std::vector<double> annulus = graded(outer / inner, kWidestRatio);
  for (std::size_t k = 0; k + 1 < annulus.size(); ++k) {
    patches.push_back({bore, circle, annulus[k], annulus[k + 1], static_cast<int>(i), false});
  }
  const std::vector<double> ruled = ruled_rings(body, tca, i);
  for (std::size_t k = 0; k + 1 < ruled.size(); ++k) {
    patches.push_back({circle, boundary, ruled[k], ruled[k + 1], -1, k + 2 == ruled.size() && is_at_surface});
  }
}

bool is_even(const PerTca& values, std::size_t count) {
  return std::all_of(values.begin(), values.begin() + count, [&](double each) { return each == values[0]; });
}

/// True for several TCAs of one radius on one circle about the axis: their cells are sectors.
bool is_ring(const Tca& tca) {
  return tca.count > 1 && tca.offset[0] > 0.0 && is_even(tca.outer_radius, tca.count) && is_even(tca.offset, tca.count);
}

/// One sector, counter-clockwise: out along one bisector, round the rim, back along the other. Azimuths of the
/// bisectors: from, to.
void add_sector(const Body& body, const Tca& tca, std::size_t i, double from, double to,
                const std::vector<Vector2d>& out, const std::vector<Vector2d>& back, std::vector<Patch>& patches) {
  for (std::size_t p = 0; p + 1 < out.size(); ++p)
    add_piece(body, tca, i, Curve::segment(out[p], out[p + 1]), false, patches);
  for (const Curve& arc : rim_arcs(body, axis_of(tca, i), from, to)) add_piece(body, tca, i, arc, true, patches);
  for (std::size_t p = back.size() - 1; p > 0; --p)
    add_piece(body, tca, i, Curve::segment(back[p], back[p - 1]), false, patches);
}

/// The patches of a ring of TCAs.
std::vector<Patch> sectors(const Body& body, const Tca& tca) {
  const std::size_t n = tca.count;
  const std::vector<std::size_t> order = by_azimuth(tca);
  std::vector<Patch> patches;
  PerTca gap{};
  std::array<std::vector<Vector2d>, kMaxTcas> bisectors;  // after each TCA, counter-clockwise
  for (std::size_t k = 0; k < n; ++k) {
    const double here = tca.azimuth[order[k]];
    gap[k] = turn(here, tca.azimuth[order[(k + 1) % n]]);
    bisectors[k] = bisector(body, tca.offset[0], here, gap[k]);
  }
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t before = (k + n - 1) % n, i = order[k];
    const double azimuth = tca.azimuth[i];
    add_sector(body, tca, i, azimuth - 0.5 * gap[before], azimuth + 0.5 * gap[k], bisectors[before], bisectors[k],
               patches);
  }
  return patches;
}

/// The angle under which a stretch is seen from an axis, counter-clockwise or not [rad].
double view(const Vector2d& axis, const Vector2d& from, const Vector2d& to) {
  const double angle = turn(angle_of(from - axis), angle_of(to - axis));
  return std::min(angle, kTurn - angle);
}

/// Points that cut a wall for the TCAs on both its sides: evenly spread in angle as seen from each, the mean of the
/// two, so many that neither sees a piece under a wide angle.
std::vector<Vector2d> wall_points(const Wall& wall, const std::vector<Circle>& circles) {
  constexpr double kSlack = 1.2;  // of the widest view, for pieces that are a compromise
  constexpr int kMostPieces = 64;
  const std::array<Vector2d, 2> axes{circles[wall.first].centre, circles[wall.second].centre};
  const Vector2d along = wall.to - wall.from;
  int n = 1;
  for (const Vector2d& axis : axes) n = std::max(n, pieces(view(axis, wall.from, wall.to), kWidestBisectorView));
  for (;; ++n) {
    std::vector<Vector2d> points{wall.from};
    for (int k = 1; k < n; ++k) {
      double share = 0.0;
      for (const Vector2d& axis : axes) {
        const Vector2d first = wall.from - axis;
        const double full = view(axis, wall.from, wall.to);
        const double sense = first.x() * along.y() - first.y() * along.x() < 0.0 ? -1.0 : 1.0;
        const Vector2d ray = on_circle(1.0, angle_of(first) + sense * full * k / n);
        // axis + a ray = from + share along
        share += 0.5 * (ray.x() * first.y() - ray.y() * first.x()) / (along.x() * ray.y() - along.y() * ray.x());
      }
      points.push_back(wall.from + share * along);
    }
    points.push_back(wall.to);
    bool is_narrow = true;
    for (int k = 0; k < n; ++k)
      for (const Vector2d& axis : axes)
        is_narrow = is_narrow && view(axis, points[k], points[k + 1]) <= kSlack * kWidestBisectorView;
    if (is_narrow || n == kMostPieces) return points;
  }
}

/// The patches of TCAs of any radii, anywhere.
std::vector<Patch> cells(const Body& body, const Tca& tca) {
  std::vector<Circle> circles;
  for (std::size_t i = 0; i < tca.count; ++i) circles.push_back({axis_of(tca, i), tca.outer_radius[i]});
  double gap = body.radius;
  for (std::size_t i = 0; i < circles.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      gap = std::min(gap, (circles[i].centre - circles[j].centre).norm() - circles[i].radius - circles[j].radius);
  const std::vector<Wall> between = walls(circles, body.radius, gap);
  std::vector<std::vector<Vector2d>> cuts;
  for (const Wall& wall : between) cuts.push_back(wall_points(wall, circles));
  std::vector<Patch> patches;
  for (std::size_t i = 0; i < tca.count; ++i) {
    const Vector2d& axis = circles[i].centre;
    if (tca.count == 1)
      for (const Curve& arc : rim_arcs(body, axis, tca.azimuth[0], tca.azimuth[0] + kTurn))
        add_piece(body, tca, 0, arc, true, patches);
    for (const Side& side : cell_sides(circles, between, i)) {
      if (side.wall == kRim) {
        const double from = angle_of(side.from);
        for (const Curve& arc : rim_arcs(body, axis, from, from + turn(from, angle_of(side.to))))
          add_piece(body, tca, i, arc, true, patches);
        continue;
      }
      std::vector<Vector2d> points = cuts[side.wall];
      if (side.is_reversed) std::reverse(points.begin(), points.end());
      for (std::size_t p = 0; p + 1 < points.size(); ++p)
        add_piece(body, tca, i, Curve::segment(points[p], points[p + 1]), false, patches);
    }
  }
  return patches;
}

/// Refuses a TCA that does not fit into the body on its own.
core::Status check_tca(const Body& body, const Tca& tca, std::size_t i) {
  const auto metres = [](double low, double high) {
    std::ostringstream text;
    text << "more than " << low << " and less than " << high << " m";
    return text.str();
  };
  const std::string index = "[" + std::to_string(i + 1) + "]";
  const double outer = tca.outer_radius[i], inner = tca.inner_radius[i], gap = kLeastGap * outer;
  if (!(outer > 0.0) || !(outer < body.radius))
    return out_of_range("tca.outer_radius" + index, outer, metres(0.0, body.radius),
                        "a TCA must fit into the body (body.radius)");
  if (!(inner > 0.0) || !(inner < outer - gap))
    return out_of_range("tca.inner_radius" + index, inner, metres(0.0, outer - gap),
                        "the bore must be smaller than the TCA (tca.outer_radius)");
  const double farthest = body.radius - outer - gap;
  if (!(tca.offset[i] >= 0.0) || !(tca.offset[i] <= farthest))
    return out_of_range(
        "tca.offset" + index, tca.offset[i], "0 to " + std::to_string(farthest) + " m (body.radius - tca.outer_radius)",
        "the TCA would stick out of the body: reduce tca.offset or tca.outer_radius, or enlarge body.radius");
  return {};
}

}  // namespace

Curve Curve::segment(const Vector2d& from, const Vector2d& to) {
  Curve curve;
  curve.middle_ = 0.5 * (from + to);
  curve.half_ = 0.5 * (to - from);
  return curve;
}

Curve Curve::arc(const Vector2d& centre, double radius, double from_angle, double to_angle) {
  Curve curve;
  curve.middle_ = centre;
  curve.radius_ = radius;
  curve.mid_angle_ = 0.5 * (from_angle + to_angle);
  curve.half_angle_ = 0.5 * (to_angle - from_angle);
  return curve;
}

Vector2d Curve::at(double s) const { return middle_ + s * half_ + on_circle(radius_, mid_angle_ + s * half_angle_); }

Vector2d Curve::slope(double s) const {
  const double angle = mid_angle_ + s * half_angle_;
  return half_ + radius_ * half_angle_ * Vector2d(-std::sin(angle), std::cos(angle));
}

core::Status check(const Body& body, const Tca& tca) {
  if (!(body.radius > 0.0))
    return out_of_range("body.radius", body.radius, "more than 0 m", "give the body's outer radius");
  if (!(body.length > 0.0)) return out_of_range("body.length", body.length, "more than 0 m", "give the body's length");
  for (std::size_t i = 0; i < tca.count; ++i)
    if (core::Status status = check_tca(body, tca, i); !status.is_ok()) return status;
  for (std::size_t i = 0; i < tca.count; ++i)
    for (std::size_t j = i + 1; j < tca.count; ++j) {
      const double b = tca.outer_radius[i], c = tca.outer_radius[j], least = b + c + kLeastGap * std::min(b, c);
      const double distance = (axis_of(tca, i) - axis_of(tca, j)).norm();
      if (!(distance >= least))
        return out_of_range(
            "the distance between the axes of TCA " + std::to_string(i + 1) + " and TCA " + std::to_string(j + 1),
            distance, "at least " + std::to_string(least) + " m (their two outer radii)",
            "the TCAs overlap: move tca.azimuth apart, enlarge tca.offset or reduce tca.outer_radius");
    }
  return {};
}

std::vector<Patch> cross_section(const Body& body, const Tca& tca) {
  return is_ring(tca) ? sectors(body, tca) : cells(body, tca);
}

std::vector<std::size_t> by_azimuth(const Tca& tca) {
  std::vector<std::size_t> order(tca.count);
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return turn(0.0, tca.azimuth[a]) < turn(0.0, tca.azimuth[b]); });
  return order;
}

bool is_cyclic(const Tca& tca) {
  constexpr double kRounding = 1e-12;  // of an azimuth [rad]: moves temperatures by no larger a part of themselves
  const std::size_t n = tca.count;
  if (n == 1) return true;
  if (!is_ring(tca)) return false;
  for (const PerTca* values : {&tca.inner_radius, &tca.k, &tca.rho_c})
    if (!is_even(*values, n)) return false;
  const std::vector<std::size_t> order = by_azimuth(tca);
  for (std::size_t k = 0; k < n; ++k) {
    const double gap = turn(tca.azimuth[order[k]], tca.azimuth[order[(k + 1) % n]]);
    if (std::abs(gap - kTurn / static_cast<double>(n)) > kRounding) return false;
  }
  return true;
}

std::vector<Patch> cyclic_cell(const Body& body, const Tca& tca) {
  Tca first = tca;
  first.azimuth[0] = 0.0;
  if (tca.count == 1) return cells(body, first);
  const double gap = kTurn / static_cast<double>(tca.count);
  const std::vector<Vector2d> back = bisector(body, tca.offset[0], 0.0, gap);
  std::vector<Vector2d> out = back;
  for (Vector2d& point : out) point.y() = -point.y();
  std::vector<Patch> patches;
  add_sector(body, first, 0, -0.5 * gap, 0.5 * gap, out, back, patches);
  return patches;
}

}  // namespace thermal
