#include "fmu/checks.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

#include "fmu/message.hpp"
#include "mechanics/rod.hpp"
#include "numerics/quadrature.hpp"

namespace rod {

namespace {

constexpr double kAngleTolerance = 1e-9;  // of azimuths that count as equal [rad], and of other relative differences

/// Largest angle [rad] by which a TCA may wind about the axis: beyond, polynomials of this order miss its bending
/// moment altogether, and no estimate from them means anything.
double max_resolved_helix(int order) { return std::max(6.3, 1.5 * (order + 1)); }

/// Name of a parameter of segment j: that of the body where it is one segment.
std::string name_in(const Parameters& p, const std::string& name, std::size_t j) {
  return p.segments == 1 ? "body." + name : "segment." + name + "[" + std::to_string(j + 1) + "]";
}

/// Fails where the sections or the unloaded shape would drive a planar rod out of its plane.
core::Status check_plane_of_segments(const Parameters& p) {
  const double c = std::cos(p.plane), s = std::sin(p.plane);
  for (std::size_t j = 0; j < p.segments; ++j) {
    const Segment& segment = p.segment[j];
    if (p.profile == Profile::given && std::abs(c * s) > kAngleTolerance)
      for (int first : {0, 3})
        if (segment.stiffness[first] != segment.stiffness[first + 1])
          return refuse("plane = ", p.plane, " rad is no principal plane of the section: ", name_in(p, "stiffness", j),
                        "[", first + 1, "] = ", segment.stiffness[first], " and ", name_in(p, "stiffness", j), "[",
                        first + 2, "] = ", segment.stiffness[first + 1],
                        " differ; set plane to a multiple of pi/2, or planar = false");
    const Triple& curvature = segment.curvature;
    const double across = c * curvature[0] + s * curvature[1], twist = curvature[2];
    const double size = std::hypot(curvature[0], curvature[1], curvature[2]);
    if (std::abs(across) > kAngleTolerance * size || std::abs(twist) > kAngleTolerance * size)
      return refuse(name_in(p, "curvature", j), " leaves the plane at azimuth plane = ", p.plane, " rad: ", across,
                    " 1/m across it, ", twist, " 1/m of twist; turn plane, or set planar = false");
  }
  return {};
}

bool is_without_force(const Tca& tca) { return tca.law == Law::measured && tca.stiffness == 0.0; }

/// Fails where section, unloaded shape or TCAs would drive a planar rod out of its plane.
core::Status check_plane(const Parameters& p) {
  if (p.dynamic && p.method == Method::pade_euler)
    return refuse(
        "planar = true has three strains at most, but method = pade_euler "
        "has all six; choose another method");
  if (core::Status status = check_plane_of_segments(p); !status.is_ok()) return status;
  for (std::size_t i = 0; i < p.tcas; ++i) {
    const Tca& tca = p.tca[i];
    if (is_without_force(tca) || (tca.offset == 0.0 && tca.offset_end == 0.0)) continue;
    const auto mirrors = [&](const Tca& other) {
      const double sum = tca.azimuth + other.azimuth - 2.0 * p.plane;
      return std::abs(std::sin(0.5 * sum)) < kAngleTolerance && std::abs(tca.helix + other.helix) < kAngleTolerance;
    };
    if (std::none_of(p.tca.begin(), p.tca.begin() + static_cast<std::ptrdiff_t>(p.tcas), mirrors))
      return refuse("TCA ", i + 1, " (tca.azimuth = ", tca.azimuth, " rad, tca.helix = ", tca.helix,
                    " rad/m) has no mirror image in the plane at azimuth plane = ", p.plane,
                    " rad; turn plane to a symmetry plane of the TCAs, or set planar "
                    "= false");
  }
  return {};
}

/// Fails where the span of TCA i is none, or leaves the body sideways.
core::Status check_routing(const Parameters& p, std::size_t i) {
  const Tca& tca = p.tca[i];
  const int last = static_cast<int>(p.segments);
  if (tca.first_segment > tca.last_segment || tca.last_segment > last)
    return refuse("tca.first_segment[", i + 1, "] = ", tca.first_segment, " and tca.last_segment[", i + 1,
                  "] = ", tca.last_segment, " are no span of a body of ", last,
                  " segments; set 1 <= first <= last <= ", last);
  const double from = p.start_of(static_cast<std::size_t>(tca.first_segment - 1)), span = p.span_of(i);
  for (std::size_t j = static_cast<std::size_t>(tca.first_segment - 1); j < static_cast<std::size_t>(tca.last_segment);
       ++j)
    for (const bool at_end : {false, true}) {
      const double s = at_end ? p.start_of(j + 1) : p.start_of(j);
      const double offset = tca.offset + (tca.offset_end - tca.offset) * (s - from) / span;
      const double radius = at_end ? p.segment[j].radius_end : p.segment[j].radius;
      if (offset >= radius)
        return refuse("tca.offset", p.tcas > 1 || p.segments > 1 ? "[" + std::to_string(i + 1) + "]" : "", " = ",
                      offset, " m lies outside the body: it must be less than body.radius = ", radius, " m",
                      p.segments > 1 ? " of segment " + std::to_string(j + 1) : "",
                      "; reduce tca.offset or enlarge body.radius");
    }
  for (std::size_t j = 0; j < p.segments; ++j)
    if (const double angle = std::abs(tca.helix) * p.segment[j].length; angle > max_resolved_helix(p.segment[j].order))
      return refuse("tca.helix[", i + 1, "] = ", tca.helix, " rad/m is ", angle, " rad over ",
                    p.segments > 1 ? "segment " + std::to_string(j + 1) : "body.length",
                    "; order = ", p.segment[j].order, " resolves ", max_resolved_helix(p.segment[j].order),
                    " rad; raise order or reduce tca.helix");
  return {};
}

/// Fails where the law of TCA i contradicts itself or the way the TCA is held.
core::Status check_law(const Parameters& p, std::size_t i) {
  const Tca& tca = p.tca[i];
  if (tca.chirality == 0)
    return refuse("tca.chirality[", i + 1, "] = 0: set +1 (extends when heated) or -1 (contracts)");
  if (tca.handedness == 0) return refuse("tca.handedness[", i + 1, "] = 0: set +1 or -1");
  if (tca.law == Law::wire && tca.wire_length <= p.span_of(i))
    return refuse("tca.wire_length[", i + 1, "] = ", tca.wire_length,
                  " m cannot be coiled into body.length = ", p.span_of(i),
                  " m; make the wire longer than the body along the TCA");
  if (p.ends == Ends::tethered && (tca.law != Law::wire || tca.pitch != Pitch::frozen))
    return refuse("tca.ends = tethered needs the torque of the TCA, but tca.law[", i + 1, "] and tca.pitch[", i + 1,
                  "] are not wire and frozen; set them so, or tca.ends = free");
  return {};
}

/// Fails where ways to hold the TCAs exclude each other.
core::Status check_contact(const Parameters& p) {
  if (p.contact == Contact::bonded && p.ends == Ends::tethered)
    return refuse(
        "tca.contact = bonded and tca.ends = tethered: a bonded TCA has no ends that could turn; "
        "set tca.contact = sliding or tca.ends = free");
  const bool is_plain = p.contact == Contact::sliding && p.ends == Ends::free;
  if (!is_plain && p.closure == Closure::exchanged)
    return refuse(
        "closure = exchanged is for TCAs that slide and turn freely; set closure = inside, or "
        "tca.contact = sliding and tca.ends = free");
  return {};
}

/// Fails where a TCA creeps in a rod that the integration of creep does not cover.
core::Status check_creep(const Parameters& p) {
  for (std::size_t i = 0; i < p.tcas; ++i) {
    if (p.tca[i].creep_compliance == 0.0) continue;
    const std::string name = "tca.creep_compliance[" + std::to_string(i + 1) + "] > 0";
    if (p.tca[i].law != Law::measured)
      return refuse(name, " acts on the spring of a measured TCA, but tca.law[", i + 1,
                    "] is wire; set it to measured, or the compliance to 0");
    if (p.dynamic)
      return refuse(name,
                    " needs dynamic = false: creep takes seconds, in which the rod is at rest; set it so, or the "
                    "compliance to 0");
    if (p.closure == Closure::exchanged || p.contact == Contact::bonded)
      return refuse(name, " needs closure = inside and tca.contact = sliding; set them so, or the compliance to 0");
  }
  return {};
}

/// Fails where the paper's scheme cannot have this body.
core::Status check_grid(const Parameters& p) {
  if (!(p.dynamic && p.method == Method::pade_euler)) return {};
  if (p.segment[0].strains != Strains::cosserat)
    return refuse("method = pade_euler has all six strains, but strains = ", static_cast<int>(p.segment[0].strains),
                  "; set strains to cosserat (4), or choose another method");
  if (!is_uniform(p))
    return refuse(
        "method = pade_euler is for one segment of constant radius with TCAs that slide and turn freely, "
        "without tip body and forces along the body; choose another method");
  return {};
}

}  // namespace

core::Status check(const Parameters& p) {
  for (std::size_t j = 0; j < p.segments; ++j) {
    const Triple& each = p.segment[j].curvature;
    const double curvature = std::hypot(each[0], each[1], each[2]) * p.segment[j].length;
    if (curvature > max_resolved_curvature())
      return refuse(name_in(p, "curvature", j), " is ", curvature, " rad over ", name_in(p, "length", j), "; at most ",
                    max_resolved_curvature(), " rad are resolved; reduce ", name_in(p, "curvature", j), " or ",
                    name_in(p, "length", j));
  }
  for (std::size_t i = 0; i < p.tcas; ++i) {
    if (core::Status status = check_routing(p, i); !status.is_ok()) return status;
    if (core::Status status = check_law(p, i); !status.is_ok()) return status;
  }
  if (core::Status status = check_contact(p); !status.is_ok()) return status;
  if (core::Status status = check_creep(p); !status.is_ok()) return status;
  if (core::Status status = check_grid(p); !status.is_ok()) return status;
  return p.planar ? check_plane(p) : core::Status();
}

core::Status check_temperatures(const Parameters& p, const PerTca<double>& T) {
  for (std::size_t i = 0; i < p.tcas; ++i) {
    if (!(T[i] > 0.0))
      return refuse("T[", i + 1, "] = ", T[i], " K; temperatures must be positive: set or connect T[", i + 1, "]");
    if (p.tca[i].law == Law::wire && !(1.0 + p.tca[i].rho_T * (T[i] - p.T_0) > 0.0))
      return refuse("T[", i + 1, "] = ", T[i], " K with tca.rho_T = ", p.tca[i].rho_T, " 1/K and T_0 = ", p.T_0,
                    " K leaves the wire no diameter; 1 + tca.rho_T (T - T_0) must be positive");
  }
  return {};
}

}  // namespace rod
