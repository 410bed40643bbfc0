// Construction of a body of segments.
#include "mechanics/segmented_rod.hpp"

#include <algorithm>
#include <cmath>

#include "mechanics/polynomials.hpp"
#include "numerics/kernel.hpp"

namespace rod {

namespace {

double radius_at(const Segment& segment, double x) {
  return segment.radius + (segment.radius_end - segment.radius) * x;
}

/// First frequency [rad/s] of a slender cantilever, by Rayleigh's quotient of its deflection under a force at the tip;
/// on a uniform one 1.5 % high. Trapezoidal rule on evenly spaced sections.
double rayleigh_frequency(const Parameters& p) {
  constexpr int kSections = 200;  // resolves tapers to 1e-4
  const double L = p.length();
  double slope = 0.0, deflection = 0.0, flexibility = 0.0, kinetic = 0.0, s = 0.0;
  std::size_t j = 0;
  double start = 0.0;
  for (int k = 0; k < kSections; ++k) {
    const double h = L / kSections;
    s = (k + 0.5) * h;
    while (j + 1 < p.segments && s > start + p.segment[j].length) start += p.segment[j++].length;
    const Section section =
        Section::of(p.segment[j], p.profile, radius_at(p.segment[j], (s - start) / p.segment[j].length));
    const double curvature = (L - s) / std::min(section.stiffness[0], section.stiffness[1]);  // of a unit force
    deflection += h * (slope + 0.5 * h * curvature);
    slope += h * curvature;
    flexibility += h * (L - s) * curvature;
    kinetic += h * section.mass * deflection * deflection;
  }
  kinetic += p.tip_body.mass * deflection * deflection;
  return std::sqrt(flexibility / kinetic);
}

}  // namespace

SegmentedRod::SegmentedRod(const Parameters& p)
    : Rod(p),
      parts_(p.segments),
      tip_body_(p.tip_body),
      contact_(p.contact),
      ends_(p.ends),
      has_load_(p.has_load),
      is_planar_(p.planar) {
  int unknowns = 0;
  for (std::size_t j = 0; j < p.segments; ++j) {
    const Segment& segment = p.segment[j];
    Part& part = parts_[j];
    double turns = std::hypot(segment.curvature[0], segment.curvature[1], segment.curvature[2]) * segment.length;
    for (std::size_t i = 0; i < p.tcas; ++i) turns = std::max(turns, std::abs(p.tca[i].helix) * segment.length);
    part.constants.grid = &quadrature(segment.order, turns);
    part.constants.length = segment.length;
    part.constants.terms = segment.order + 1;
    part.components = components_of(segment.strains, p.planar, part.excluded);
    part.constants.count = static_cast<int>(part.components.size());
    std::ranges::copy(part.components, part.constants.components.begin());
    const auto reference = Section::of(segment, p.profile, segment.radius).seen_from(frame_).reference;
    part.constants.kappa = segment.length * Vec3{reference[0], reference[1], reference[2]};
    part.first = unknowns;
    unknowns += part.unknowns();
    add_inertia(p, j, part);
    add_stiffness(p, j, part);
    route_tcas(p, j, part);
    part.loops = segment_loops(part.constants);
    part.tangent_loops = segment_tangent_loops(part.constants);
  }
  for (Part& part : parts_) part.constants.inertia_along = &part.inertia;  // the parts no longer move
  stiffness_.resize(unknowns);
  for (const Part& part : parts_) stiffness_.segment(part.first, part.unknowns()) = part.stiffness.diagonal();
  for (std::size_t i = 0; i < p.tcas; ++i)
    for (const Part& part : parts_) span_[i] += part.reference_path[i];
  first_frequency_ = rayleigh_frequency(p);
  locate_stations(p);
}

void SegmentedRod::add_inertia(const Parameters& p, std::size_t j, Part& part) const {
  const Quadrature& grid = *part.constants.grid;
  const Segment& segment = p.segment[j];
  for (int k = 0; k < grid.nodes; ++k) {
    const Section section = Section::of(segment, p.profile, radius_at(segment, grid.s[k]));
    part.inertia.mass[k] = section.mass;
    part.inertia.rotary[k] = section.inertia.x;
    part.inertia.mass_total += grid.w[k] * section.mass;
  }
  for (int node = 0; node < grid.nodes; ++node)  // the node's Lagrange polynomial, integrated from each node to the end
    for (int k = 0; k < grid.nodes; ++k)
      part.inertia.mass_beyond[k] += (grid.w[node] - grid.forward[node][k]) * part.inertia.mass[node];
}

void SegmentedRod::add_stiffness(const Parameters& p, std::size_t j, Part& part) const {
  const Quadrature& grid = *part.constants.grid;
  const Segment& segment = p.segment[j];
  for (int k = 0; k < grid.nodes; ++k) {
    const Section section = Section::of(segment, p.profile, radius_at(segment, grid.s[k])).seen_from(frame_);
    for (std::size_t c = 0; c < 6; ++c)  // curvatures are multiplied by the length
      part.local_stiffness[c][k] = section.stiffness[c] * (c < 3 ? 1.0 / segment.length : segment.length);
  }
  const int terms = part.constants.terms, count = part.constants.count;
  part.retardation = segment.retardation;
  part.stiffness.setZero(part.unknowns(), part.unknowns());
  for (int i = 0; i < count; ++i)
    for (int a = 0; a < terms; ++a)
      for (int b = 0; b < terms; ++b)
        for (int k = 0; k < grid.nodes; ++k)
          part.stiffness(a * count + i, b * count + i) +=
              grid.moment[a][k] * grid.legendre[b][k] * part.local_stiffness[part.components[i]][k];
}

void SegmentedRod::route_tcas(const Parameters& p, std::size_t j, Part& part) const {
  const Quadrature& grid = *part.constants.grid;
  RodConstants& constants = part.constants;
  constants.tcas = p.tcas;
  constants.offset.resize(p.tcas);
  constants.slope.resize(p.tcas);
  part.reference_length.resize(p.tcas);
  const double L = constants.length;
  for (std::size_t i = 0; i < p.tcas; ++i) {
    const Tca& tca = p.tca[i];
    const int number = static_cast<int>(j) + 1;
    constants.is_routed[i] = tca.first_segment <= number && number <= tca.last_segment;
    if (!constants.is_routed[i]) continue;
    const double span = p.span_of(i), from = p.start_of(static_cast<std::size_t>(tca.first_segment - 1));
    const double gradient = (tca.offset_end - tca.offset) / span;
    for (int k = 0; k < grid.nodes; ++k) {
      const double s = p.start_of(j) + L * grid.s[k];
      const double angle = tca.azimuth + tca.helix * s, distance = tca.offset + gradient * (s - from);
      const Vec3 direction = frame_.to_frame(Vec3{std::cos(angle), std::sin(angle), 0.0});
      const Vec3 r = (distance / L) * direction;
      const Vec3 slope = (tca.helix * distance) * Vec3{-direction.y, direction.x, 0.0} + gradient * direction;
      constants.offset[i].put(k, r);
      constants.slope[i].put(k, slope);
      const Vec3 u = constants.lambda + cross(constants.kappa, r) + slope;
      const double length = std::sqrt(dot(u, u));
      part.reference_length[i][k] = length;
      part.reference_path[i] += L * grid.w[k] * length;
      part.reference_twist[i] += grid.w[k] * dot(constants.kappa, u) / length;
    }
  }
}

void SegmentedRod::locate_stations(const Parameters& p) {
  const double spacing = p.length() / (kShapeStations - 1);
  for (std::size_t m = 0; m < kShapeStations; ++m) {
    const double s = spacing * static_cast<double>(m);
    std::size_t j = 0;
    while (j + 1 < parts_.size() && s > p.start_of(j + 1)) ++j;
    stations_[m].segment = j;
    const double x = std::clamp((s - p.start_of(j)) / p.segment[j].length, 0.0, 1.0);
    integral_weights(*parts_[j].constants.grid, x, stations_[m].weights);
  }
  if (!has_load_) return;
  // int_x^y of the hat function of station m, in units of the spacing: its antiderivative, which is 0 left of it.
  const auto antiderivative = [](double z) {
    z = std::clamp(z, -1.0, 1.0);
    return z <= 0.0 ? 0.5 * (1.0 + z) * (1.0 + z) : 1.0 - 0.5 * (1.0 - z) * (1.0 - z);
  };
  for (std::size_t j = 0; j < parts_.size(); ++j) {
    Part& part = parts_[j];
    const double from = p.start_of(j), to = p.start_of(j + 1);
    for (std::size_t m = 0; m < kShapeStations; ++m) {
      const auto integral_to = [&](double s) {
        return spacing * antiderivative(std::clamp(s, 0.0, p.length()) / spacing - static_cast<double>(m));
      };
      part.hat_total[m] = integral_to(to) - integral_to(from);
      for (int k = 0; k < part.constants.grid->nodes; ++k)
        part.hat[m][k] = integral_to(to) - integral_to(from + part.constants.length * part.constants.grid->s[k]);
    }
  }
}

void SegmentedRod::to_states(const double* unknowns, double* states) const {
  for (const Part& part : parts_) {
    double* own = states;
    std::fill_n(states, kStrainStates, 0.0);
    for (int a = 0; a < part.constants.terms; ++a, own += 6) {
      std::array<double, 6> strains{};
      for (int c : part.components) strains[c] = *unknowns++;
      for (int first : {0, 3}) {
        const Vec3 seen = frame_.from_frame({strains[first], strains[first + 1], strains[first + 2]});
        own[first] = seen.x, own[first + 1] = seen.y, own[first + 2] = seen.z;
      }
    }
    states += kStrainStates;
  }
}

void SegmentedRod::from_states(const double* states, double* unknowns) const {
  for (const Part& part : parts_) {
    const double* own = states;
    for (int a = 0; a < part.constants.terms; ++a, own += 6)
      for (int c : part.components) {
        const int first = c / 3 * 3;
        const Vec3 seen = frame_.to_frame(Vec3{own[first], own[first + 1], own[first + 2]});
        *unknowns++ = c % 3 == 0 ? seen.x : c % 3 == 1 ? seen.y : seen.z;
      }
    states += kStrainStates;
  }
}

void SegmentedRod::damping_force(ConstVectorRef v, Vector& force) const {
  force.resize(unknowns());
  for (const Part& part : parts_) {
    const int n = part.unknowns();
    force.segment(part.first, n).noalias() = part.retardation * (part.stiffness * v.segment(part.first, n));
  }
}

double SegmentedRod::damping_power(ConstVectorRef v) const {
  double power = 0.0;
  for (const Part& part : parts_) {
    const int n = part.unknowns();
    const auto own = v.segment(part.first, n);
    for (int column = 0; column < n; ++column)
      power += part.retardation * own[column] * part.stiffness.col(column).dot(own);
  }
  return power;
}

Rod::StrainRange SegmentedRod::strain_range(const double* q) const {
  StrainRange worst{.curvature = 0.0, .max_curvature = 1.0, .stretch = INFINITY};
  for (const Part& part : parts_) {
    const RodConstants& constants = part.constants;
    VectorField kappa, lambda;
    for (int p = 0; p < constants.grid->packs; ++p)
      kappa.set(p, broadcast(constants.kappa)), lambda.set(p, broadcast(constants.lambda));
    add_expansion<kMaxPacks>(constants, q + part.first, kappa, lambda);
    for (int k = 0; k < constants.grid->nodes; ++k) {
      const double curvature = std::sqrt(dot(kappa.at(k), kappa.at(k)));
      if (curvature * worst.max_curvature >= worst.curvature * constants.grid->max_curvature)
        worst.curvature = curvature, worst.max_curvature = constants.grid->max_curvature;
      worst.stretch = std::min(worst.stretch, lambda.z[k]);
    }
  }
  return worst;
}

}  // namespace rod
