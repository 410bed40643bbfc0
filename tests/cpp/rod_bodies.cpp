// Bodies of segments: equilibria against independent shooting and energy minimisation, frequencies,
// energy, the same body cut into segments.
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
