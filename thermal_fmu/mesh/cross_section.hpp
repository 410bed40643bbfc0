// The cross-section as curved quadrilaterals: a disc (body) with N round holes (bores), each in an annulus (TCA).
//
// Every TCA owns the cell of the points that are nearest to it (cells.hpp): a convex region, for TCAs of one radius on
// one circle the sector up to the bisectors towards its neighbours. Round the TCA the cell is cut where its boundary
// has corners, and further so that no piece is seen from the TCA's axis under a wide angle. Each piece is ruled twice:
// bore to TCA circle, TCA circle to the cell's boundary; both rings are split radially as their ratio of radii asks
// for. Circles are exact.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/status.hpp"
#include "physics/parameters.hpp"

namespace thermal {

/// A segment of a line or of a circle, run through by s in [-1, 1].
class Curve {
 public:
  static Curve segment(const Eigen::Vector2d& from, const Eigen::Vector2d& to);
  static Curve arc(const Eigen::Vector2d& centre, double radius, double from_angle, double to_angle);
  Eigen::Vector2d at(double s) const;
  Eigen::Vector2d slope(double s) const;

 private:
  Eigen::Vector2d middle_ = Eigen::Vector2d::Zero();  // of the line, or the circle's centre
  Eigen::Vector2d half_ = Eigen::Vector2d::Zero();    // of the line; zero for an arc
  double radius_ = 0.0;
  double mid_angle_ = 0.0;
  double half_angle_ = 0.0;
};

/// The part t in [t_from, t_to] of the surface (1 - t) inner(s) + t outer(s).
struct Patch {
  Curve inner;
  Curve outer;
  double t_from = 0.0;
  double t_to = 1.0;
  int tca = -1;                // -1: body
  bool is_at_surface = false;  // its side t = t_to lies on the outer circle
};

/// An error with value, range and remedy when the TCAs do not fit into the body.
core::Status check(const Body& body, const Tca& tca);

/// The patches of a cross-section that check() accepts.
std::vector<Patch> cross_section(const Body& body, const Tca& tca);

/// TCA indices by azimuth in [0, 2 pi).
std::vector<std::size_t> by_azimuth(const Tca& tca);

/// True for equal TCAs on one circle about the axis at even azimuths, to rounding, and for a single TCA: the section
/// is the same after a turn from TCA to TCA, and its own mirror image in the plane through the axes of TCA and body.
bool is_cyclic(const Tca& tca);

/// The patches of the cell of one TCA of such a section, as if that TCA had index 0 and azimuth 0.
std::vector<Patch> cyclic_cell(const Body& body, const Tca& tca);

}  // namespace thermal
