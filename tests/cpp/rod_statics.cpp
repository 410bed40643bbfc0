// Equilibria against independent numbers and closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "rod_support.hpp"

using namespace rod;
using rod_test::Bench;

namespace {

/// Largest error of tip and displacements [m] against the references, with strains of the given order.
double reference_error(int order) {
  double worst = 0.0;
  for (const auto& row : rod_test::read_csv("rod_static.csv")) {
    Parameters p;
    p.set(&Segment::order, order);
    Bench bench(p);
    for (int c = 0; c < 3; ++c) bench.inputs.gravity[c][0] = row[1 + c];
    for (int i = 0; i < 3; ++i) bench.inputs.T[i][0] = row[4 + i] + 273.15;
    EXPECT_TRUE(bench.solve_equilibrium());
    const Outputs y = bench.outputs();
    for (int c = 0; c < 3; ++c)
      worst = std::max({worst, std::abs(y.tip_p[c] - row[7 + c]), std::abs(y.delta[c] - row[13 + c])});
  }
  return worst;
}

}  // namespace

TEST(RodStatics, ReferencesAreMetFromOrderFourOn) {
  for (int order = 4; order <= kMaxOrder; ++order) EXPECT_LT(reference_error(order), 2e-7) << "order " << order;
}

TEST(RodStatics, ConvergesSpectrallyInTheOrder) {
  EXPECT_GT(reference_error(0), 1e-3);
  EXPECT_LT(reference_error(2), 0.3 * reference_error(1));
  EXPECT_LT(reference_error(3), 0.3 * reference_error(2));
  EXPECT_LT(reference_error(4), 0.3 * reference_error(3));
}

TEST(RodStatics, WithoutLoadsBodyAndActuatorsCarryNoWrench) {
  Parameters p;
  Bench bench(p);
  bench.inputs.T[0][0] = 350.0, bench.inputs.T[1][0] = 320.0;
  ASSERT_TRUE(bench.solve_equilibrium());
  bench.outputs();
  const Section section = Section::of(p);
  const Workspace& work = bench.scratch.newton.work;
  // Strain is constant: the order-0 coefficients are the strains, and W = K (xi - xi*) + sum N [r x t; t] must vanish.
  for (int j = 6; j < bench.rod.unknowns(); ++j) EXPECT_NEAR(bench.state.q[j], 0.0, 1e-12);
  for (int k = 0; k < quadrature(p.segment[0].order).nodes; ++k) {
    Vec3 couple{section.stiffness[0] * bench.state.q[0] / p.length(),
                section.stiffness[1] * bench.state.q[1] / p.length(),
                section.stiffness[2] * bench.state.q[2] / p.length()};
    Vec3 force{section.stiffness[3] * bench.state.q[3], section.stiffness[4] * bench.state.q[4],
               section.stiffness[5] * bench.state.q[5]};
    for (std::size_t i = 0; i < kTcas; ++i) {
      couple = couple + (work.tension[i].value * p.length()) * work.arm[i].at(k);
      force = force + work.tension[i].value * work.t[i].at(k);
    }
    EXPECT_LT(std::sqrt(dot(force, force)), 1e-12);
    EXPECT_LT(std::sqrt(dot(couple, couple)), 1e-14);
  }
}

TEST(RodStatics, SmallStrainClosedForms) {
  const Parameters p;
  const TcaLaw law(p, 0);
  const Section section = Section::of(p);
  const double EI = section.stiffness[0], EA = section.stiffness[5], k = law.stiffness(), L = p.length(),
               r = p.tca[0].offset;
  const double dT = 1e-4;
  Bench all(p), one(p);
  for (auto& T : all.inputs.T) T[0] = p.T_0 + dT;
  one.inputs.T[0][0] = p.T_0 + dT;
  ASSERT_TRUE(all.solve_equilibrium() && one.solve_equilibrium());
  const double c = law.free_stroke(p.T_0 + dT);
  const double stretch = 3 * k * c / (EA + 3 * k * L), curvature = k * r * c / (EI + 1.5 * k * L * r * r);
  EXPECT_NEAR(all.state.q[5], stretch, 1e-5 * stretch);
  EXPECT_NEAR(std::hypot(one.state.q[0], one.state.q[1]) / L, curvature, 1e-5 * curvature);
}

TEST(RodStatics, HigherOrdersChangeNothingWithoutLoads) {
  Parameters p;
  p.set(&Segment::order, 0);
  Bench constant(p);
  p.set(&Segment::order, 7);
  Bench rich(p);
  for (Bench* bench : {&constant, &rich}) {
    bench->inputs.T[0][0] = 360.0, bench->inputs.T[2][0] = 310.0;
    ASSERT_TRUE(bench->solve_equilibrium());
  }
  const Outputs a = constant.outputs(), b = rich.outputs();
  for (std::size_t i = 0; i < kTcas; ++i) EXPECT_NEAR(a.delta[i], b.delta[i], 1e-9 * std::abs(a.delta[i]));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a.tip_p[c], b.tip_p[c], 1e-9 * p.length());
}

TEST(RodStatics, RollUpClosesOnItself) {
  Parameters p = rod_test::bare_rod();
  Bench bench(p);
  bench.inputs.tip_moment[1][0] = 2 * M_PI * Section::of(p).stiffness[1] / p.length();
  ASSERT_TRUE(bench.solve_equilibrium());
  EXPECT_EQ(bench.scratch.stability.doubt(), Stability::Doubt::unstable)
      << "a dead moment would turn it out of its plane";
  const Outputs y = bench.outputs();
  for (double x : y.tip_p) EXPECT_NEAR(x, 0.0, 1e-12);
}

TEST(RodStatics, ElasticaUnderADeadTipForce) {
  // Elliptic integrals: deflection/L, shortening/L, tip angle for P L^2/EI = 1, 2, 5, 10.
  constexpr double known[4][4] = {{1, .30172077, .05643324, .46135195},
                                  {2, .49345748, .16064172, .78174983},
                                  {5, .71379152, .38762836, 1.21536812},
                                  {10, .81060902, .55499560, 1.43028554}};
  Parameters p = rod_test::bare_rod();
  p.set(&Segment::strains, Strains::bending);  // neither shears nor stretches
  p.set(&Segment::order, 7);
  for (const auto& [load, deflection, shortening, angle] : known) {
    Bench bench(p);
    bench.inputs.tip_force[0][0] = load * Section::of(p).stiffness[0] / (p.length() * p.length());
    ASSERT_TRUE(bench.solve_equilibrium());
    const Outputs y = bench.outputs();
    EXPECT_NEAR(y.tip_p[0] / p.length(), deflection, 1e-6);
    EXPECT_NEAR(1.0 - y.tip_p[2] / p.length(), shortening, 1e-6);
    EXPECT_NEAR(y.tip_euler[1], angle, 1e-5);
  }
}

TEST(RodStatics, LongRodsAndStiffActuatorsUnderGravityFindAnEquilibrium) {
  int computed = 0, tried = 0;
  for (double length : {0.06, 0.08, 0.1})
    for (double stiffness : {1e2, 1e3, 1e4})
      for (double gravity : {-9.81, 9.81}) {
        Parameters p;
        p.set(&Segment::length, length);
        p.set(&Tca::law, Law::measured);
        p.set(&Tca::stiffness, stiffness);
        Bench bench(p);
        bench.inputs.gravity[0][0] = 3.0, bench.inputs.gravity[2][0] = gravity;
        bench.inputs.T[0][0] = 340.0;
        computed += bench.solve_equilibrium();
        ++tried;
      }
  EXPECT_EQ(computed, tried);
}

TEST(RodStatics, QuasiStaticStepsKnowHowTheEquilibriumMoves) {
  for (Closure closure : {Closure::inside, Closure::exchanged}) {
    Parameters p;
    p.closure = closure;
    Bench bench(p);
    const auto at = [&](double t) {  // all loads on their way
      bench.inputs.gravity[0] = {3.0 + 2.0 * t, 2.0, 0.0, 0.0};
      bench.inputs.T[0] = {p.T_0 + 20.0 + 5.0 * t, 5.0, 0.0, 0.0};
      for (Polynomial& guess : bench.inputs.delta_guess) guess = {1e-3 + 1e-3 * t, 1e-3, 0.0, 0.0};
      bench.inputs.tip_force[1] = {1e-3 * t, 1e-3, 0.0, 0.0};
      EXPECT_EQ(step_static(bench.rod, bench.inputs, 1e-9, bench.state, bench.scratch).reached, 1e-9);
      return bench.outputs();
    };
    const double e = 1e-4;
    const Outputs before = at(1.0 - e), here = at(1.0), after = at(1.0 + e);
    for (std::size_t i = 0; i < kTcas; ++i)
      EXPECT_NEAR(here.delta_rate[i], (after.delta[i] - before.delta[i]) / (2 * e),
                  1e-6 * std::abs(here.delta_rate[0]));
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(here.tip_v[c], (after.tip_p[c] - before.tip_p[c]) / (2 * e), 1e-6 * std::abs(here.tip_v[0]));
  }
}

TEST(RodStatics, ViolentLoadsConvergeOrAreRefused) {
  for (double force : {0.5, 5.0, 50.0})
    for (double kelvin : {0.0, 300.0}) {
      Bench bench(Parameters{});
      bench.inputs.tip_force[0][0] = force;
      bench.inputs.gravity[1][0] = 1000.0;
      bench.inputs.T[0][0] += kelvin;
      const bool computed = bench.solve_equilibrium();
      EXPECT_TRUE(bench.state.q.allFinite());
      if (!computed) {
        EXPECT_EQ(bench.state.q.norm(), 0.0) << "a failed solve must leave the state alone";
      }
    }
}
