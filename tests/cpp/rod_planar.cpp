// The planar rod: the same numbers as the spatial one where nothing leaves the plane, in any plane; its own balances;
// what it says where something does.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "probe/host.hpp"
#include "rod_support.hpp"

using namespace rod;
using rod_test::bare_rod;
using rod_test::Bench;

namespace {

/// In the plane at this azimuth: gravity, a tip load and heat, mirrored.
Inputs in_plane(double plane, const Parameters& p) {
  Inputs u;
  const double c = std::cos(plane), s = std::sin(plane);
  u.gravity[0] = {6.0 * c, 1.0 * c, 0, 0}, u.gravity[1] = {6.0 * s, 1.0 * s, 0, 0}, u.gravity[2] = {-2.0, 0, 0, 0};
  u.tip_force[0] = {1e-3 * c, 0, 0, 0}, u.tip_force[1] = {1e-3 * s, 0, 0, 0};
  u.tip_moment[0] = {-2e-5 * s, 0, 0, 0}, u.tip_moment[1] = {2e-5 * c, 0, 0, 0};
  for (std::size_t i = 0; i < kTcas; ++i) u.T[i][0] += 15.0 * (1.0 + std::cos(p.tca[i].azimuth - plane));
  return u;
}

double difference(const Outputs& a, const Outputs& b) {
  double worst = 0.0;
  const auto compare = [&worst](const auto& x, const auto& y, double scale) {
    for (std::size_t k = 0; k < x.size(); ++k) worst = std::max(worst, std::abs(x[k] - y[k]) / scale);
  };
  for (std::size_t m = 0; m < kShapeStations; ++m) compare(a.shape[m], b.shape[m], 0.04);
  compare(a.tip_euler, b.tip_euler, 1.0), compare(a.tip_quaternion, b.tip_quaternion, 1.0);
  compare(a.tip_v, b.tip_v, 1.0), compare(a.delta, b.delta, 0.04), compare(a.delta_rate, b.delta_rate, 1.0);
  compare(a.N, b.N, 1.0);
  const auto energies = [](const Outputs& y) {
    return std::array{y.energy_elastic, y.energy_tca, y.energy_kinetic, y.energy_gravity, y.energy_dissipated};
  };
  compare(energies(a), energies(b), 1e-4);
  return worst;
}

constexpr double third = 2.0 * std::numbers::pi / 3.0;

}  // namespace

TEST(RodPlanar, EqualsTheSpatialRodInEverySymmetryPlane) {
  static_assert(kTcas == 3);
  for (Strains strains : {Strains::bending, Strains::extensible, Strains::kirchhoff, Strains::cosserat})
    for (int order : {0, 3, 4, 6})
      for (double plane : {0.0, third, -0.5 * third}) {
        Parameters p;
        p.set(&Segment::strains, strains), p.set(&Segment::order, order), p.plane = plane,
                                                                          p.set(&Segment::retardation, 2e-3);
        p.set(&Segment::curvature, {-8.0 * std::sin(plane), 8.0 * std::cos(plane), 0.0});
        Bench spatial(p);
        p.planar = true;
        Bench planar(p);
        EXPECT_EQ(planar.rod.unknowns(), (order + 1) * (strains == Strains::bending    ? 1
                                                        : strains == Strains::cosserat ? 3
                                                                                       : 2));
        spatial.inputs = planar.inputs = in_plane(plane, p);
        ASSERT_TRUE(spatial.solve_equilibrium() && planar.solve_equilibrium());
        EXPECT_LT(difference(spatial.outputs(), planar.outputs()), 1e-10) << "at rest, order " << order;
        for (Bench* bench : {&spatial, &planar}) {
          bench->inputs.T[0] = bench->inputs.T[1] = bench->inputs.T[2] = {298.15, 0, 0, 0};
          bench->state.next_step = 1e-3;
          for (int i = 0; i < 8; ++i)  // a tolerance that accepts every step: both make the same
            ASSERT_EQ(step_rosenbrock(bench->rod, bench->inputs, 1e-3, 1e9, bench->state, bench->scratch).reached,
                      1e-3);
        }
        const Outputs moved = spatial.outputs();
        EXPECT_GT(moved.energy_kinetic, 1e-9);
        EXPECT_LT(difference(moved, planar.outputs()), 1e-10) << "moving, order " << order << ", plane " << plane;
        EXPECT_LT(planar.outputs().out_of_plane, 1e-12);
      }
}

TEST(RodPlanar, ReleaseAgainstTheReference) {
  const auto rows = rod_test::read_csv("rod_release.csv");
  for (bool damped : {false, true}) {
    Parameters p = bare_rod();
    p.planar = true;
    p.set(&Segment::order, 7);
    p.set(&Segment::retardation, damped ? 5e-3 : 0.0);
    Bench bench(p);
    bench.inputs.gravity[0][0] = 9.81;
    double t = 0.0;
    for (const auto& row : rows) {
      step_rosenbrock(bench.rod, bench.inputs, row[0] - t, damped ? 1e-7 : 1e-5, bench.state, bench.scratch);
      t = row[0];
      const Outputs y = bench.outputs();
      const double error = std::hypot(y.tip_p[2] * 1e3 - row[1 + 2 * damped], y.tip_p[0] * 1e3 - row[2 + 2 * damped]);
      EXPECT_LT(error, damped ? 2e-4 : t < 0.3 ? 2e-3 : 2e-2) << "t = " << t;  // mm
    }
  }
}

TEST(RodPlanar, RollsUpToACircle) {
  Parameters p = bare_rod();
  p.planar = true;
  Bench bench(p);
  bench.inputs.tip_moment[1][0] = 2.0 * std::numbers::pi * Section::of(p).stiffness[1] / p.length();
  ASSERT_TRUE(bench.solve_equilibrium());
  for (double x : bench.outputs().tip_p) EXPECT_NEAR(x, 0.0, 1e-6 * p.length());
}

TEST(RodPlanar, KeepsItsEnergy) {
  Parameters p;
  p.planar = true, p.set(&Segment::order, 2);
  Bench bench(p);
  bench.inputs.tip_force[0][0] = 3e-3;
  ASSERT_TRUE(bench.solve_equilibrium());
  bench.inputs.tip_force[0][0] = 0.0;
  const auto total = [&bench] {
    const Outputs y = bench.outputs();
    return y.energy_kinetic + y.energy_elastic + y.energy_tca;
  };
  const double before = total();
  ASSERT_EQ(step_rosenbrock(bench.rod, bench.inputs, 0.5, 1e-9, bench.state, bench.scratch).reached, 0.5);
  EXPECT_NEAR(total(), before, 0.5e-8 * before);
}

TEST(RodPlanar, StepsAllocateNothingAndRepeat) {
  Parameters p;
  p.planar = true, p.set(&Segment::retardation, 5e-3);
  Bench one(p), two(p);
  one.inputs = two.inputs = in_plane(0.0, p);
  for (Bench* bench : {&one, &two}) {  // the first step sizes the scratch
    bench->solve_equilibrium();
    step_rosenbrock(bench->rod, bench->inputs, 1e-2, 1e-6, bench->state, bench->scratch);
    step_midpoint(bench->rod, bench->inputs, 1e-3, bench->state, bench->scratch);
    std::fill(bench->memory.begin(), bench->memory.end(), 0.0);
  }
  const std::size_t before = rod_test::allocations;
  one.solve_equilibrium();
  for (Bench* bench : {&one, &two}) {
    if (bench == &two) std::copy(one.memory.begin(), one.memory.end(), two.memory.begin());
    bench->inputs.gravity[0][0] = 3.0;
  }
  for (Bench* bench : {&one, &two}) {
    EXPECT_EQ(step_rosenbrock(bench->rod, bench->inputs, 1e-2, 1e-6, bench->state, bench->scratch).reached, 1e-2);
    EXPECT_EQ(step_midpoint(bench->rod, bench->inputs, 1e-3, bench->state, bench->scratch).reached, 1e-3);
  }
  EXPECT_EQ(rod_test::allocations, before);
  EXPECT_EQ(one.memory, two.memory);
}

TEST(RodPlanar, MeasuresWhatIsLeftOut) {
  Parameters p = bare_rod();
  p.planar = true, p.plane = 0.4;
  const double moment = 1e-6;
  Bench bench(p);
  bench.inputs.tip_moment[0][0] = moment * std::cos(p.plane);
  bench.inputs.tip_moment[1][0] = moment * std::sin(p.plane);  // about the plane's own axis: all of it across
  EXPECT_NEAR(bench.outputs().out_of_plane, moment * p.length() / Section::of(p).stiffness[0], 1e-15);
  bench.inputs = Inputs{};
  const double force = 1e-4;
  bench.inputs.tip_force[0][0] = -force * std::sin(p.plane), bench.inputs.tip_force[1][0] = force * std::cos(p.plane);
  const double clamp = force * p.length() * p.length() / Section::of(p).stiffness[0];
  const double seen = bench.outputs().out_of_plane;  // at the first node, which is close to the clamp
  EXPECT_LT(seen, clamp);
  EXPECT_GT(seen, 0.98 * clamp);
  // Uneven heat across the plane: EI kappa = k r stroke (sin a_2 - sin a_3), to first order.
  Parameters hot;
  hot.planar = true;
  Bench heated(hot);
  heated.inputs.T[1][0] += 1.0;
  const TcaLaw law(hot, 0);
  const double couple = law.stiffness() * hot.tca[0].offset * law.free_stroke(hot.T_0 + 1.0) * std::sin(third);
  EXPECT_NEAR(heated.outputs().out_of_plane, couple * hot.length() / Section::of(hot).stiffness[0], 1e-12);
}

TEST(RodPlanarFmu, RefusesWhatIsNotSymmetric) {
  const auto refused = [](auto set, std::initializer_list<std::string> words) {
    probe::Host host;
    host.set_boolean("planar", true);
    set(host);
    EXPECT_EQ(fmi2EnterInitializationMode(host.fmu), fmi2OK);
    EXPECT_EQ(fmi2ExitInitializationMode(host.fmu), fmi2Error);
    EXPECT_TRUE(host.said(words));
  };
  refused([](auto& host) { host.set("plane", 0.5); }, {"TCA 1", "plane = 0.5", "planar = false"});
  refused([](auto& host) { host.set("tca.helix[1]", 30.0); }, {"TCA 1", "tca.helix = 30"});
  refused([](auto& host) { host.set("body.curvature[1]", 3.0); }, {"body.curvature", "3 1/m across", "plane"});
  refused([](auto& host) { host.set_integer("method", static_cast<int>(Method::pade_euler)); }, {"pade_euler"});
  refused(
      [](auto& host) {
        host.set("plane", third);
        host.set_integer("body.profile", static_cast<int>(Profile::given));
        host.set("body.stiffness[2]", 2.0);
      },
      {"principal plane", "body.stiffness[2] = 2"});
}

TEST(RodPlanarFmu, WarnsOnceOfForcesAcrossItsPlane) {
  probe::Host host;
  host.set_boolean("planar", true);
  host.start();
  EXPECT_LT(host.get("out_of_plane"), 1e-15);
  host.set("gravity[2]", 1.0);
  for (int i = 0; i < 3; ++i) ASSERT_EQ(fmi2DoStep(host.fmu, 0.01 * i, 0.01, fmi2True), fmi2OK);
  double value = 0.0;
  const fmi2ValueReference vr = probe::reference("out_of_plane");
  EXPECT_EQ(fmi2GetReal(host.fmu, &vr, 1, &value), fmi2Warning);
  EXPECT_GT(value, 1e-2);
  EXPECT_EQ(host.get("out_of_plane"), value);
  ASSERT_EQ(fmi2DoStep(host.fmu, 0.03, 0.01, fmi2True), fmi2OK);
  EXPECT_GT(host.get("out_of_plane"), 1e-2);
  ASSERT_EQ(host.messages.size(), 1u);
  EXPECT_EQ(host.messages[0].status, fmi2Warning);
  EXPECT_TRUE(host.said({"across the plane", "planar = false"}));
}
