// Bodies of segments: equilibria against independent shooting and energy minimisation, exact derivatives of random
// bodies, balance of momentum, the same body cut into segments.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "mechanics/segmented_rod.hpp"
#include "mechanics/uniform_rod.hpp"
#include "rod_support.hpp"

using namespace rod;
using rod_test::Bench;
using rod_test::RandomState;

namespace {

struct Case {
  Triple T, tip, delta;
  Triple gravity{};
  Triple tip_force{};
};

/// Solves for the equilibrium and compares it with the case.
void expect(const Parameters& p, const Case& expected, double bound) {
  Bench bench(p);
  for (std::size_t c = 0; c < 3; ++c) {
    bench.inputs.T[c][0] = expected.T[c];
    bench.inputs.gravity[c][0] = expected.gravity[c];
    bench.inputs.tip_force[c][0] = expected.tip_force[c];
  }
  ASSERT_TRUE(bench.solve_equilibrium());
  const Outputs y = bench.outputs();
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(y.tip_p[c], expected.tip[c], bound);
    EXPECT_NEAR(y.delta[c], expected.delta[c], bound);
  }
}

Parameters order(int degree, std::size_t segments = 1) {
  Parameters p(3, segments);
  p.set(&Segment::order, degree);
  return p;
}

/// TCAs over the first of two halves.
Parameters half_actuated(int degree) {
  Parameters p = order(degree, 2);
  p.set(&Tca::last_segment, 1);
  p.set(&Tca::wire_length, 65e-3), p.set(&Tca::coils, 18.75), p.set(&Tca::twists, 50);
  return p;
}

Parameters tapered(int degree) {
  Parameters p = order(degree);
  p.segment[0].radius_end = 3e-3;
  p.set(&Tca::offset, 2e-3), p.set(&Tca::offset_end, 2e-3);
  return p;
}

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

}  // namespace

TEST(RodBodies, SpansTapersAndPayloadsAgreeWithShooting) {
  const Triple warm{340, 298.15, 298.15};
  const Case span{warm, {-0.019542403496, 0, 0.034967872054}, {0.0027645118, 0.0002026051, 0.0002026051}};
  expect(half_actuated(0), span, 1e-9);
  expect(half_actuated(5), span, 1e-9);
  expect(half_actuated(5),
         {warm, {-0.013494056618, 0, 0.037977563671}, {0.0023914217, 0.0003807563, 0.0003807563}, {9.81, 0, 0}}, 1e-7);
  const Triple three{300, 310, 330};
  expect(tapered(5), {three, {0.0131007875, 0.0112361935, 0.0358317098}, {0.0005471117, 0.0020773316, 0.0050793032}},
         1e-7);
  expect(tapered(5),
         {three, {0.0108141981, 0.0153252810, 0.0349663252}, {0.0005912064, 0.0019616698, 0.0051437596}, {-3, 5, -2}},
         1e-7);
  Parameters payload = order(5);
  payload.tip_body = {.mass = 2e-3, .inertia = {}, .centre = {0, 0, 5e-3}};
  const Triple cold{298.15, 298.15, 298.15};
  expect(payload,
         {cold, {0.019015607591, 0, 0.034724986571}, {-0.0011843146, 0.0006712178, 0.0006712178}, {9.81, 0, 0}}, 1e-7);
}

TEST(RodBodies, TcasOfTheirOwnLawsAndOffsetsAgreeWithShooting) {
  Parameters laws = order(5);
  laws.tca[1].chirality = -1;
  laws.tca[2].law = Law::measured, laws.tca[2].stiffness = 30.0, laws.tca[2].stroke = 2e-4;
  expect(laws,
         {{320, 330, 310}, {-0.0181763855, 0.0178597391, 0.0251888585}, {0.0026828028, -0.0039509623, 0.0008513126}},
         1e-7);
  Parameters slanted = order(5);
  slanted.set(&Tca::offset, 3e-3), slanted.set(&Tca::offset_end, 1.5e-3);
  expect(slanted,
         {{330, 298.15, 305}, {-0.0201626077, 0.0042880209, 0.0347498942}, {0.0041465314, 0.0004838173, 0.0012846008}},
         1e-7);
}

TEST(RodBodies, BondedAndTetheredTcasAgreeWithEnergyMinimisation) {
  const Triple cold{298.15, 298.15, 298.15}, warm{340, 298.15, 298.15};
  Parameters bonded = order(5);
  bonded.contact = Contact::bonded;
  expect(bonded, {cold, {5.8580847e-3, 0, 39.5418261e-3}, {-4.292345e-4, 2.251111e-4, 2.251111e-4}, {9.81, 0, 0}},
         1e-7);
  expect(
      bonded,
      {cold, {-4.5648e-8, 9.1475302e-3, 38.7744772e-3}, {1.53227e-5, -6.7114588e-4, 7.0150042e-4}, {}, {0, 20e-3, 0}},
      1e-7);
  const Case heat{warm, {-24.5640785e-3, 0, 30.1797302e-3}, {5.5290236e-3, 4.052101e-4, 4.052101e-4}};
  expect(bonded, heat, 1e-7);
  expect(order(5), heat, 1e-7);
  Parameters tethered = order(5);
  tethered.ends = Ends::tethered;
  expect(tethered, {warm, {-23.4461922e-3, -3.3191997e-3, 31.1431553e-3}, {5.3166204e-3, 4.157096e-4, 4.157096e-4}},
         1e-7);
  expect(tethered,
         {cold, {8.4561942e-3, -1.33962e-7, 39.0397613e-3}, {-4.155882e-4, 2.235504e-4, 2.235530e-4}, {9.81, 0, 0}},
         1e-7);
}

TEST(RodBodies, FrequenciesTendToThoseOfSlenderBeams) {
  struct Beam {
    double taper, payload, first, second;  // radius at the tip over that at the clamp; mass at the tip over the beam's
  };
  for (const Beam& beam : {Beam{0.6, 0.0, 4.318779, 20.049984}, Beam{0.3, 0.0, 5.509262, 18.641255},
                           Beam{1.0, 1.0, 1.557298, 16.250085}}) {
    double before = 1.0;
    for (const double slenderness : {25.0, 100.0}) {
      Parameters p = order(5, 2);
      p.set(&Segment::strains, Strains::bending), p.set(&Tca::law, Law::measured), p.set(&Tca::stiffness, 0.0);
      const double radius = p.length() / slenderness, middle = 0.5 * (1.0 + beam.taper) * radius;
      p.segment[0].radius = radius, p.segment[0].radius_end = p.segment[1].radius = middle;
      p.segment[1].radius_end = beam.taper * radius;
      p.set(&Tca::offset, 0.1 * beam.taper * radius), p.set(&Tca::offset_end, 0.1 * beam.taper * radius);
      const Section clamp = Section::of(p.segment[0], p.profile, radius);
      p.tip_body.mass = beam.payload * clamp.mass * p.length();
      const auto rod = make_rod(p);
      Workspace work;
      Vector r, zero = Vector::Zero(rod->unknowns());
      rod->residual(zero.data(), zero.data(), zero.data(), Loads(), work, r);
      Matrix K, M;
      rod->tangent(work, {.q = 1.0}, K);
      rod->tangent(work, {.a = 1.0}, M);
      const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix> modes(0.5 * (K + K.transpose()),
                                                                   0.5 * (M + M.transpose()));
      const double unit = std::sqrt(clamp.stiffness[0] / clamp.mass) / (p.length() * p.length());
      const double first = std::sqrt(modes.eigenvalues()[0]) / unit, second = std::sqrt(modes.eigenvalues()[2]) / unit;
      const double error = std::max(std::abs(first / beam.first - 1.0), std::abs(second / beam.second - 1.0));
      EXPECT_LT(error, 0.2 * before);
      before = error;
    }
    EXPECT_LT(before, 1e-3);
  }
}

TEST(RodBodies, EnergyOfBondedAndTetheredTcasIsKept) {
  for (const bool bonded : {true, false}) {
    Parameters p = order(2);
    p.contact = bonded ? Contact::bonded : Contact::sliding;
    p.ends = bonded ? Ends::free : Ends::tethered;
    Bench bench(p);
    bench.inputs.T[0][0] = 330.0, bench.inputs.gravity[1][0] = 5.0;
    const auto total = [&bench] {
      const Outputs y = bench.outputs();
      return y.energy_elastic + y.energy_kinetic + y.energy_gravity + y.energy_tca;
    };
    const double before = total();
    ASSERT_EQ(step_rosenbrock(bench.rod, bench.inputs, 0.02, 1e-11, bench.state, bench.scratch).reached, 0.02);
    EXPECT_NEAR(total(), before, 1e-9 * before);
  }
}

TEST(RodBodies, CuttingABodyChangesNothing) {
  for (const std::size_t segments : {2u, 4u}) {
    Bench whole(order(7)), cut(order(5, segments));
    for (Bench* bench : {&whole, &cut}) {
      bench->inputs.T[0][0] += 30.0, bench->inputs.gravity[0][0] = 4.0, bench->inputs.tip_force[1][0] = 5e-3;
      ASSERT_TRUE(bench->solve_equilibrium());
    }
    const Outputs a = whole.outputs(), b = cut.outputs();
    for (std::size_t m = 0; m < kShapeStations; ++m)
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(a.shape[m][c], b.shape[m][c], 2e-8);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a.delta[i], b.delta[i], 2e-9);
    EXPECT_NEAR(a.energy_elastic, b.energy_elastic, 1e-6 * a.energy_elastic);
  }
}

TEST(RodBodies, ASegmentIsTheUniformRod) {
  Parameters p = order(4);
  p.set(&Segment::retardation, 0.01);
  const UniformRod uniform(p);
  const SegmentedRod segmented(p);
  const RandomState x(uniform.unknowns(), 3);
  Inputs u;
  u.gravity[0][0] = 3.0, u.tip_force[1][0] = 0.01, u.tip_moment[2][0] = 1e-4, u.T[1][0] = 330.0;
  const Loads loads = loads_at(u, 0.0);
  Workspace a, b;
  Vector ra, rb;
  uniform.residual(x.q.data(), x.v.data(), x.a.data(), loads, a, ra);
  segmented.residual(x.q.data(), x.v.data(), x.a.data(), loads, b, rb);
  EXPECT_LT((ra - rb).norm(), 1e-13 * ra.norm());
  Matrix Ja, Jb;
  uniform.tangent(a, {1.0, 50.0, 2500.0}, Ja);
  segmented.tangent(b, {1.0, 50.0, 2500.0}, Jb);
  EXPECT_LT((Ja - Jb).norm(), 1e-13 * Ja.norm());
  Outputs ya, yb;
  uniform.clamp_reaction(loads, a, ya);
  segmented.clamp_reaction(loads, b, yb);
  uniform.outputs(x.q.data(), x.v.data(), loads, a, ya);
  segmented.outputs(x.q.data(), x.v.data(), loads, b, yb);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(ya.base_force[c], yb.base_force[c], 1e-12);
    EXPECT_NEAR(ya.base_moment[c], yb.base_moment[c], 1e-13);
    EXPECT_NEAR(ya.tip_euler[c], yb.tip_euler[c], 1e-12);
    EXPECT_NEAR(ya.tip_v[c], yb.tip_v[c], 1e-12);
  }
  EXPECT_NEAR(ya.energy_kinetic, yb.energy_kinetic, 1e-12 * ya.energy_kinetic);
  EXPECT_NEAR(ya.energy_gravity, yb.energy_gravity, 1e-14);
  EXPECT_NEAR(uniform.first_frequency(), segmented.first_frequency(), 0.03 * uniform.first_frequency());
}

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
  EXPECT_LT(rod_test::error(along, J * d.q), 1e-9 * J.norm() * d.q.norm());

  Vector dr;
  rod.rate_derivative(work, d.v, d.a, dr);
  const auto rates = [&](double e) {
    const Vector v = x.v + e * d.v, a = x.a + e * d.a;
    rod.residual(x.q.data(), v.data(), a.data(), loads, other, out);
    return out;
  };
  EXPECT_LT(rod_test::error(rates, dr), 1e-9 * dr.norm());

  rod.load_derivative(work, loads, load_rates_at(u, 0.0), dr);
  const auto in_time = [&](double e) {
    rod.residual(x.q.data(), x.v.data(), x.a.data(), loads_at(u, e), other, out);
    return out;
  };
  EXPECT_LT(rod_test::error(in_time, dr), 1e-9 * (dr.norm() + r.norm()));

  rod.static_residual(x.q.data(), loads, work, r);
  rod.tangent(work, {.q = 1.0}, J);
  const auto at_rest = [&](double e) {
    const Vector q = x.q + e * d.q;
    rod.static_residual(q.data(), loads, other, out);
    return out;
  };
  EXPECT_LT(rod_test::error(at_rest, J * d.q), 1e-9 * J.norm() * d.q.norm());
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
  EXPECT_LT(size(vector(y.base_force) + force - dp), 1e-9 * size(dp));
  EXPECT_LT(size(vector(y.base_moment) + moment - dh), 1e-9 * size(dh));
}

INSTANTIATE_TEST_SUITE_P(Random, Bodies,
                         testing::Combine(testing::Values(1u, 2u, 3u), testing::Values(Contact::sliding),
                                          testing::Values(Ends::free, Ends::tethered), testing::Bool()));
INSTANTIATE_TEST_SUITE_P(RandomBonded, Bodies,
                         testing::Combine(testing::Values(1u, 4u, 5u), testing::Values(Contact::bonded),
                                          testing::Values(Ends::free), testing::Bool()));
