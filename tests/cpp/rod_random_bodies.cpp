// Random bodies of segments: exact derivatives, balance of momentum.
#include <gtest/gtest.h>

#include <random>
#include <sstream>

#include "mechanics/segmented_rod.hpp"
#include "rod_support.hpp"

using namespace rod;
using rod_test::Bench;
using rod_test::RandomState;

namespace {

/// A body of every feature, at random.
Parameters random_body(unsigned seed, Contact contact, Ends ends, bool planar) {
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto number = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  const std::size_t segments = seed == 1 ? kMaxSegments : static_cast<std::size_t>(number(1, 4));
  Parameters p(seed == 1 ? kMaxTcas : static_cast<std::size_t>(number(1, 6)), segments);
  p.contact = contact, p.ends = ends, p.planar = planar, p.plane = 0.4, p.has_load = true;
  for (std::size_t j = 0; j < segments; ++j) {
    Segment& s = p.segment[j];
    s.length = uniform(5e-3, 20e-3), s.radius = uniform(3e-3, 6e-3), s.radius_end = uniform(3e-3, 6e-3);
    s.E = uniform(2e4, 2e5), s.nu = uniform(0.2, 0.5), s.rho = uniform(900, 1500), s.retardation = uniform(0, 0.02);
    s.order = number(0, 3), s.strains = static_cast<Strains>(number(1, 4));
    if (!planar) s.curvature = {uniform(-9, 9), uniform(-9, 9), uniform(-9, 9)};
  }
  for (std::size_t i = 0; i < p.tcas; ++i) {
    Tca& t = p.tca[i];
    t.azimuth = uniform(0, 6), t.helix = planar ? 0.0 : uniform(-30, 30);
    t.offset = uniform(0, 2.5e-3), t.offset_end = uniform(0, 2.5e-3);
    t.first_segment = number(1, static_cast<int>(segments));
    t.last_segment = number(t.first_segment, static_cast<int>(segments));
    t.chirality = number(0, 1) ? 1 : -1, t.handedness = number(0, 1) ? 1 : -1;
    if (ends == Ends::free && number(0, 1))
      t.law = Law::measured, t.stiffening = 500.0, t.stop = 0.0, t.stop_stiffness = 50.0, t.stroke_curvature = 1e-6;
  }
  p.tip_body = {.mass = 2e-3, .inertia = {1e-8, 2e-8, 3e-8}, .centre = {1e-3, -2e-3, 5e-3}};
  return p;
}

Inputs random_loads(const Parameters& p, unsigned seed) {
  std::mt19937 random(seed);
  const auto uniform = [&](double size) { return std::uniform_real_distribution<double>(-size, size)(random); };
  Inputs u = Bench::inputs_of(p);
  for (std::size_t c = 0; c < 3; ++c) {
    u.gravity[c] = {uniform(9), uniform(2), 0, 0};
    u.tip_force[c] = {uniform(0.02), uniform(0.1), 0, 0};
    u.tip_moment[c] = {uniform(2e-4), uniform(1e-3), 0, 0};
    const double start = uniform(0.5), end = uniform(0.5), rate = uniform(1.0);
    for (std::size_t m = 0; m < kShapeStations; ++m)  // linear along the body: quadratures of it are exact
      u.load[m][c] = {start + (end - start) * static_cast<double>(m) / (kShapeStations - 1), rate, 0, 0};
  }
  for (std::size_t i = 0; i < p.tcas; ++i) u.T[i] = {320 + uniform(20), uniform(5), 0, 0};
  return u;
}

class Bodies : public testing::TestWithParam<std::tuple<unsigned, Contact, Ends, bool>> {
 protected:
  Parameters body() const {
    const auto [seed, contact, ends, planar] = GetParam();
    return random_body(seed, contact, ends, planar);
  }
};

Vec3 vector(const Triple& a) { return {a[0], a[1], a[2]}; }

/// Linear and angular momentum about the clamp of a body that moves.
struct Momentum {
  Vec3 linear, angular;
};
Momentum momentum(const Parameters& p, const Workspace& work) {
  Momentum sum;
  const auto add = [&sum](double mass, const Vec3& at, const Vec3& velocity) {
    sum.linear = sum.linear + mass * velocity;
    sum.angular = sum.angular + mass * cross(at, velocity);
  };
  for (std::size_t j = 0; j < p.segments; ++j) {
    const Segment& s = p.segment[j];
    const SegmentWorkspace& w = work.segments[j];
    const Quadrature& grid = quadrature(s.order, std::hypot(s.curvature[0], s.curvature[1], s.curvature[2]) * s.length);
    for (int k = 0; k < grid.nodes; ++k) {
      Vec3 at = w.base.p;
      for (int node = 0; node < grid.nodes; ++node) at = at + s.length * grid.forward[node][k] * w.l.at(node);
      const Section section = Section::of(s, p.profile, s.radius + (s.radius_end - s.radius) * grid.s[k]);
      const double ds = s.length * grid.w[k];
      add(ds * section.mass, at, s.length * w.velocity.at(k));
      const Vec3 spin = scale(section.inertia, w.omega_body.at(k));
      const Rotation<double> R{{w.R.row0.x[k], w.R.row0.y[k], w.R.row0.z[k]},
                               {w.R.row1.x[k], w.R.row1.y[k], w.R.row1.z[k]},
                               {w.R.row2.x[k], w.R.row2.y[k], w.R.row2.z[k]}};
      sum.angular = sum.angular + ds * (R * spin);
    }
  }
  const SectionMotion& tip = work.segments.back().tip;
  const Vec3 arm = tip.R * vector(p.tip_body.centre);
  add(p.tip_body.mass, tip.p + arm, tip.v + cross(tip.omega, arm));
  sum.angular = sum.angular + tip.R * scale(vector(p.tip_body.inertia), transpose_times(tip.R, tip.omega));
  return sum;
}

double size(const Vec3& a) { return std::sqrt(dot(a, a)); }

/// Checks a relative error and writes it into the test's report (--gtest_output=json).
void expect_small(const char* what, double error, double scale) {
  EXPECT_LT(error, 1e-9 * scale) << what;
  std::ostringstream text;
  text << error / scale;
  testing::Test::RecordProperty(what, text.str());
}

}  // namespace

TEST_P(Bodies, DerivativesAreExact) {
  const Parameters p = body();
  const SegmentedRod rod(p);
  const int n = rod.unknowns();
  const Inputs u = random_loads(p, 7);
  const Loads loads = loads_at(u, 0.0);
  const RandomState x(n, 8), d(n, 9);
  Workspace work, other;
  Vector r, out;
  rod.residual(x.q.data(), x.v.data(), x.a.data(), loads, work, r);
  const Weights weights{0.7, 30.0, 900.0};
  Matrix J;
  rod.tangent(work, weights, J);
  const auto along = [&](double e) {
    const Vector q = x.q + e * weights.q * d.q, v = x.v + e * weights.v * d.q, a = x.a + e * weights.a * d.q;
    rod.residual(q.data(), v.data(), a.data(), loads, other, out);
    return out;
  };
  expect_small("tangent", rod_test::error(along, J * d.q), J.norm() * d.q.norm());

  Vector dr;
  rod.rate_derivative(work, d.v, d.a, dr);
  const auto rates = [&](double e) {
    const Vector v = x.v + e * d.v, a = x.a + e * d.a;
    rod.residual(x.q.data(), v.data(), a.data(), loads, other, out);
    return out;
  };
  expect_small("by_rates", rod_test::error(rates, dr), dr.norm());

  rod.load_derivative(work, loads, load_rates_at(u, 0.0), dr);
  const auto in_time = [&](double e) {
    rod.residual(x.q.data(), x.v.data(), x.a.data(), loads_at(u, e), other, out);
    return out;
  };
  expect_small("by_loads", rod_test::error(in_time, dr), dr.norm() + r.norm());

  rod.static_residual(x.q.data(), loads, work, r);
  rod.tangent(work, {.q = 1.0}, J);
  const auto at_rest = [&](double e) {
    const Vector q = x.q + e * d.q;
    rod.static_residual(q.data(), loads, other, out);
    return out;
  };
  expect_small("static_tangent", rod_test::error(at_rest, J * d.q), J.norm() * d.q.norm());
}

TEST_P(Bodies, ForcesOfTheClampChangeTheMomentum) {
  const Parameters p = body();
  if (p.planar) GTEST_SKIP() << "forces across the plane have no effect";
  const SegmentedRod rod(p);
  const Inputs u = random_loads(p, 11);
  const Loads loads = loads_at(u, 0.0);
  const RandomState x(rod.unknowns(), 12);
  Workspace work, other;
  Vector r;
  rod.residual(x.q.data(), x.v.data(), x.a.data(), loads, work, r);
  Outputs y;
  rod.clamp_reaction(loads, work, y);
  const auto at = [&](double e) {
    const Vector q = x.q + e * x.v + 0.5 * e * e * x.a, v = x.v + e * x.a;
    rod.kinematics(q.data(), v.data(), loads, other);
    return momentum(p, other);
  };
  const double e = 1e-5;
  const Momentum p1 = at(e), m1 = at(-e), p2 = at(2 * e), m2 = at(-2 * e);
  const auto slope = [&](Vec3 Momentum::*part) {
    return (1.0 / (12.0 * e)) * (8.0 * (p1.*part - m1.*part) - (p2.*part - m2.*part));
  };
  // All other forces: at the tip, weight, along the body; their moments about the clamp.
  rod.kinematics(x.q.data(), x.v.data(), loads, other);
  Vec3 force = loads.tip_force, moment = loads.tip_moment + cross(other.segments.back().tip.p, loads.tip_force);
  for (std::size_t j = 0; j < p.segments; ++j) {
    const Segment& s = p.segment[j];
    const SegmentWorkspace& w = other.segments[j];
    const Quadrature& grid = quadrature(s.order, std::hypot(s.curvature[0], s.curvature[1], s.curvature[2]) * s.length);
    for (int k = 0; k < grid.nodes; ++k) {
      const double share = (p.start_of(j) + s.length * grid.s[k]) / p.length();
      const Section section = Section::of(s, p.profile, s.radius + (s.radius_end - s.radius) * grid.s[k]);
      const Vec3 density =
          (1.0 - share) * loads.load.front() + share * loads.load.back() + section.mass * loads.gravity;
      Vec3 at_node = w.base.p;
      for (int node = 0; node < grid.nodes; ++node) at_node = at_node + s.length * grid.forward[node][k] * w.l.at(node);
      force = force + (s.length * grid.w[k]) * density;
      moment = moment + (s.length * grid.w[k]) * cross(at_node, density);
    }
  }
  const SectionMotion& tip = other.segments.back().tip;
  const Vec3 weight = p.tip_body.mass * loads.gravity;
  force = force + weight, moment = moment + cross(tip.p + tip.R * vector(p.tip_body.centre), weight);
  const Vec3 dp = slope(&Momentum::linear), dh = slope(&Momentum::angular);
  expect_small("clamp_force", size(vector(y.base_force) + force - dp), size(dp));
  expect_small("clamp_moment", size(vector(y.base_moment) + moment - dh), size(dh));
}

INSTANTIATE_TEST_SUITE_P(Random, Bodies,
                         testing::Combine(testing::Values(1u, 2u, 3u), testing::Values(Contact::sliding),
                                          testing::Values(Ends::free, Ends::tethered), testing::Bool()));
INSTANTIATE_TEST_SUITE_P(RandomBonded, Bodies,
                         testing::Combine(testing::Values(1u, 4u, 5u), testing::Values(Contact::bonded),
                                          testing::Values(Ends::free), testing::Bool()));
