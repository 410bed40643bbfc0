#include "fmu/doubts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "fmu/message.hpp"

namespace rod {

namespace {

constexpr double kSlack = 1e-9;  // of moments of inertia and lengths

/// Moments that no body has: each is at most the sum of the other two, and none comes without mass.
std::string doubt_tip_body(const TipBody& body) {
  const auto& [x, y, z] = body.inertia;
  const double largest = std::max({x, y, z});
  if (largest == 0.0) return {};
  if (body.mass == 0.0)
    return message("tip_body.inertia is up to ", largest,
                   " kg.m2, but tip_body.mass = 0: no body has these; set the mass, or the inertia to 0");
  if (largest > 0.5 * (x + y + z) * (1.0 + kSlack))
    return message("tip_body.inertia = ", x, ", ", y, ", ", z,
                   " kg.m2: no body has these, each is at most the sum of the other two; correct the largest");
  return {};
}

/// A wire too thick for its coils: thicker than they are wide, or than the distance from one to the next.
std::string doubt_coils(const Parameters& p, std::size_t i) {
  const Tca& tca = p.tca[i];
  if (tca.law != Law::wire) return {};
  const double sine = p.span_of(i) / tca.wire_length, cosine = std::sqrt(1.0 - sine * sine);
  const double width = tca.wire_length * cosine / (std::numbers::pi * tca.coils);
  const double distance = p.span_of(i) / tca.coils * cosine;
  const double room = std::min(width, distance);
  if (tca.wire_diameter <= room * (1.0 + kSlack)) return {};
  return message("tca.wire_diameter[", i + 1, "] = ", tca.wire_diameter, " m, but coils of tca.wire_length[", i + 1,
                 "] = ", tca.wire_length, " m and tca.coils[", i + 1, "] = ", tca.coils, " have room for ", room,
                 " m: they are ", width, " m wide and ", distance,
                 " m apart; take a thinner wire, or change its length and coils");
}

}  // namespace

std::string doubt_parameters(const Parameters& p) {
  if (std::string doubt = doubt_tip_body(p.tip_body); !doubt.empty()) return doubt;
  for (std::size_t i = 0; i < p.tcas; ++i)
    if (std::string doubt = doubt_coils(p, i); !doubt.empty()) return doubt;
  return {};
}

DisplacementRange::DisplacementRange(const Parameters& p, std::size_t i)
    : shortest(-std::numeric_limits<double>::infinity()), longest(std::numeric_limits<double>::infinity()) {
  const Tca& tca = p.tca[i];
  if (tca.law != Law::wire) return;
  const double span = p.span_of(i);
  shortest = std::min(tca.coils * tca.wire_diameter, span) - span;
  longest = tca.wire_length - span;
}

std::string doubt_displacement(const Parameters& p, std::size_t i, const DisplacementRange& range, double delta) {
  if (delta > range.longest)
    return message("TCA ", i + 1, " is longer by delta = ", delta,
                   " m, its wire of tca.wire_length = ", p.tca[i].wire_length, " m is straight at ", range.longest,
                   " m: beyond, its law has no meaning; reduce the loads or the heat, or take a longer wire");
  return message("TCA ", i + 1, " is shorter by delta = ", delta, " m, its coils touch at ", range.shortest,
                 " m, which tca.law = wire leaves out; reduce the loads or the heat, take fewer coils or a thinner "
                 "wire, or set tca.law = measured with tca.stop");
}

}  // namespace rod
