#include "mesh/cross_section.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <sstream>

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

/// TCA indices by azimuth in [0, 2 pi).
std::vector<std::size_t> sorted(const PerTca& azimuth) {
  std::vector<std::size_t> order(kTcas);
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return turn(0.0, azimuth[a]) < turn(0.0, azimuth[b]); });
  return order;
}

/// Points along the bisector between two neighbours, from the axis to the rim, evenly spread in angle as seen from
/// either TCA: the two are mirror images, so they agree on the points.
std::vector<Vector2d> bisector(const Body& body, const Tca& tca, double azimuth, double gap) {
  const Vector2d axis = on_circle(tca.offset, azimuth);
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
std::vector<double> ruled_rings(const Body& body, const Tca& tca) {
  constexpr double kFirst = 0.33, kFiner = 5.0, kThinnest = 1e-4;
  const double b = tca.outer_radius, a = tca.inner_radius;
  const double layer = tca.rho_c * (b * b - a * a) / (2.0 * b * body.rho_c);  // of body with a TCA's heat capacity [m]
  std::vector<double> ends{1.0, kFirst};
  const double reach = body.radius / b - 1.0;  // longest way, in radii of the TCA
  while ((ends.back() * b > 3.0 * layer || ends.back() * reach > kWidestRatio) && ends.back() > kThinnest)
    ends.push_back(ends.back() / kFiner);
  ends.push_back(0.0);
  return {ends.rbegin(), ends.rend()};
}

/// One piece of a sector: annulus and ruled rings between the TCA's axis and a stretch of the sector's boundary.
void add_piece(const Body& body, const Tca& tca, int index, const Vector2d& axis, const Curve& boundary,
               bool is_at_surface, std::vector<Patch>& patches) {
  const double from = angle_of(boundary.at(-1.0) - axis);
  const double to = from + turn(from, angle_of(boundary.at(1.0) - axis));
  const Curve bore = Curve::arc(axis, tca.inner_radius, from, to);
  const Curve circle = Curve::arc(axis, tca.outer_radius, from, to);
  const std::vector<double> annulus = graded(tca.outer_radius / tca.inner_radius, kWidestRatio);
  for (std::size_t i = 0; i + 1 < annulus.size(); ++i) {
    patches.push_back({bore, circle, annulus[i], annulus[i + 1], index, false});
  }
  const std::vector<double> ruled = ruled_rings(body, tca);
  for (std::size_t i = 0; i + 1 < ruled.size(); ++i) {
    patches.push_back({circle, boundary, ruled[i], ruled[i + 1], -1, i + 2 == ruled.size() && is_at_surface});
  }
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
  const auto metres = [](double low, double high) {
    std::ostringstream text;
    text << "more than " << low << " and less than " << high << " m";
    return text.str();
  };
  if (!(body.radius > 0.0))
    return out_of_range("body.radius", body.radius, "more than 0 m", "give the body's outer radius");
  if (!(body.length > 0.0)) return out_of_range("body.length", body.length, "more than 0 m", "give the body's length");
  const double gap = kLeastGap * tca.outer_radius;
  if (!(tca.outer_radius > 0.0) || !(tca.outer_radius < body.radius)) {
    return out_of_range("tca.outer_radius", tca.outer_radius, metres(0.0, body.radius),
                        "a TCA must fit into the body (body.radius)");
  }
  if (!(tca.inner_radius > 0.0) || !(tca.inner_radius < tca.outer_radius - gap)) {
    return out_of_range("tca.inner_radius", tca.inner_radius, metres(0.0, tca.outer_radius - gap),
                        "the bore must be smaller than the TCA (tca.outer_radius)");
  }
  const double farthest = body.radius - tca.outer_radius - gap;
  if (!(tca.offset >= 0.0) || !(tca.offset <= farthest)) {
    return out_of_range(
        "tca.offset", tca.offset, "0 to " + std::to_string(farthest) + " m (body.radius - tca.outer_radius)",
        "the TCA would stick out of the body: reduce tca.offset or tca.outer_radius, or enlarge body.radius");
  }
  if (kTcas == 1) return {};
  const std::vector<std::size_t> order = sorted(tca.azimuth);
  for (std::size_t k = 0; k < kTcas; ++k) {
    const std::size_t i = order[k], j = order[(k + 1) % kTcas];
    const double distance = (on_circle(tca.offset, tca.azimuth[i]) - on_circle(tca.offset, tca.azimuth[j])).norm();
    if (!(distance >= 2.0 * tca.outer_radius + gap)) {
      return out_of_range(
          "the distance between the axes of TCA " + std::to_string(i + 1) + " and TCA " + std::to_string(j + 1),
          distance, "at least " + std::to_string(2.0 * tca.outer_radius + gap) + " m (two outer radii)",
          "the TCAs overlap: move tca.azimuth apart, enlarge tca.offset or reduce tca.outer_radius");
    }
  }
  return {};
}

std::vector<Patch> cross_section(const Body& body, const Tca& tca) {
  std::vector<Patch> patches;
  if (kTcas == 1) {
    const double azimuth = tca.azimuth[0];
    const Vector2d axis = on_circle(tca.offset, azimuth);
    for (const Curve& arc : rim_arcs(body, axis, azimuth, azimuth + kTurn))
      add_piece(body, tca, 0, axis, arc, true, patches);
    return patches;
  }
  const std::vector<std::size_t> order = sorted(tca.azimuth);
  std::array<double, kTcas> gap{};
  std::array<std::vector<Vector2d>, kTcas> bisectors;  // after each TCA, counter-clockwise
  for (std::size_t k = 0; k < kTcas; ++k) {
    const double here = tca.azimuth[order[k]];
    gap[k] = turn(here, tca.azimuth[order[(k + 1) % kTcas]]);
    bisectors[k] = bisector(body, tca, here, gap[k]);
  }
  for (std::size_t k = 0; k < kTcas; ++k) {
    const std::size_t before = (k + kTcas - 1) % kTcas;
    const int index = static_cast<int>(order[k]);
    const double azimuth = tca.azimuth[order[k]];
    const Vector2d axis = on_circle(tca.offset, azimuth);
    // Counter-clockwise: out along one bisector, round the rim, back along the other.
    const std::vector<Vector2d>& out = bisectors[before];
    for (std::size_t i = 0; i + 1 < out.size(); ++i) {
      add_piece(body, tca, index, axis, Curve::segment(out[i], out[i + 1]), false, patches);
    }
    for (const Curve& arc : rim_arcs(body, axis, azimuth - 0.5 * gap[before], azimuth + 0.5 * gap[k])) {
      add_piece(body, tca, index, axis, arc, true, patches);
    }
    const std::vector<Vector2d>& back = bisectors[k];
    for (std::size_t i = back.size() - 1; i > 0; --i) {
      add_piece(body, tca, index, axis, Curve::segment(back[i], back[i - 1]), false, patches);
    }
  }
  return patches;
}

}  // namespace thermal
