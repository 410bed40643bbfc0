// The paper's scheme under violence and in a host: failing steps, restored memory, no allocation, refusals.
#include <gtest/gtest.h>

#include "probe/host.hpp"
#include "rod_pade_support.hpp"

using namespace rod_test;

TEST(RodPade, RestoredMemoryStepsBitwiseTheSame) {
  GridBench one(twisted(5e-3), 21), two(twisted(5e-3), 21);
  shake(one.inputs, 0.02, 10, [&one](double h) { one.step(h); });
  two.inputs = one.inputs;
  two.memory.assign(one.memory.begin(), one.memory.end());
  two.state = GridState(two.memory.data(), 21, 3);
  for (int i = 0; i < 3; ++i) one.step(2e-3), two.step(2e-3);
  EXPECT_EQ(one.memory, two.memory);
}

TEST(RodPade, NewtonsFailureHalvesTheStepOrEndsItEarly) {
  // The rate of displacement is that of the last piece, so it tells whether a step went in one piece.
  const auto mean_against_last = [](double gravity) {
    GridBench bench(Parameters{}, 21);
    const double h = 1e-3;
    bench.inputs.gravity[2][0] = -gravity;
    bench.step(h);
    const Outputs y = bench.outputs();
    return y.delta[0] / h / y.delta_rate[0];
  };
  EXPECT_NEAR(mean_against_last(10.0), 1.0, 1e-9);
  EXPECT_GT(std::abs(mean_against_last(1e4) - 1.0), 0.01);

  GridBench part(Parameters{}, 21);
  part.inputs.gravity[1][0] = 3000.0;
  const StepOutcome some = part.rod.step(part.inputs, 0.01, part.state, part.scratch);
  EXPECT_GT(some.reached, 0.0);
  EXPECT_LT(some.reached, 0.01);
  EXPECT_FALSE(some.status.is_ok());
  for (double x : part.memory) EXPECT_TRUE(std::isfinite(x));
  EXPECT_GT(part.rod.step(part.inputs, 1e-5, part.state, part.scratch).reached, 0.0) << "on it goes, slowly";

  GridBench none(Parameters{}, 21);
  none.inputs.tip_moment[1][0] = 0.1;  // 200 radians
  const std::vector<double> before = none.memory;
  EXPECT_EQ(none.rod.step(none.inputs, 1e-3, none.state, none.scratch).reached, 0.0);
  EXPECT_EQ(none.memory, before);
}

TEST(RodPade, ViolentStepsConvergeOrLeaveTheStateUsable) {
  for (double h : {1e-4, 1e-2, 10.0})
    for (double force : {0.0, 1.0, 50.0})
      for (double kelvin : {0.0, 300.0}) {
        GridBench bench(Parameters{}, 21);
        bench.inputs.tip_force[0][0] = force;
        bench.inputs.T[0][0] += kelvin;
        const std::vector<double> before = bench.memory;
        const StepOutcome result = bench.rod.step(bench.inputs, h, bench.state, bench.scratch);
        EXPECT_TRUE(result.reached == h ? result.status.is_ok() : !result.status.is_ok());
        for (double x : bench.memory) EXPECT_TRUE(std::isfinite(x));
        if (result.reached == 0.0) {
          EXPECT_EQ(bench.memory, before);
        }
        EXPECT_EQ(bench.rod.step(bench.inputs, 1e-3, bench.state, bench.scratch).reached, 1e-3)  // and on it goes
            << "after h = " << h << " s, " << force << " N, " << kelvin << " K";
      }
}

TEST(RodPade, HeatAtAStrokeIsApproachedInShares) {
  // 300 K in one long step: the section is unstable at the first guess; the end is the equilibrium all the same.
  Parameters p;
  GridBench bench(p, 21);
  Bench other(p);
  bench.inputs.T[0][0] = other.inputs.T[0][0] = 598.15;
  bench.step(1e3);
  for (int i = 0; i < 3; ++i) bench.step(1e3);
  ASSERT_TRUE(other.solve_equilibrium());
  EXPECT_LT(difference(bench.outputs(), other.outputs()), 1e-3 * p.length());
}

/// The tip after one step behind a jump of a TCA's temperature.
struct Jump {
  double x;        // of the tip [m]
  bool is_warned;  // that the step is short for the grid
};

Jump jump(int method, int points, double retardation, double h) {
  probe::Host host;
  host.set_integer("method", method), host.set_integer("grid_points", points);
  host.set("body.retardation", retardation), host.set("T[1]", 310.0);
  host.start();
  EXPECT_LE(fmi2DoStep(host.fmu, 0.0, h, fmi2True), fmi2Warning);
  return {host.get("tip.p[1]"), host.said({"shorter than", "one grid interval"})};
}

TEST(RodPadeFmu, SaysWhereStepsAreShorterThanTheGridResolves) {
  constexpr int kPade = 5, kRosenbrock = 1;
  const Jump coarse = jump(kPade, 21, 0.0, 1e-6), fine = jump(kPade, 101, 0.0, 1e-6);
  EXPECT_TRUE(coarse.is_warned && fine.is_warned);
  EXPECT_NEAR(coarse.x, 12.0e-6, 0.1e-6) << "the wrong way, by the strain of one interval";
  EXPECT_NEAR(fine.x / coarse.x, 1.0 / 25.0, 2e-3) << "the square of the spacing";
  const Jump longer = jump(kPade, 21, 0.0, 1e-3);
  EXPECT_FALSE(longer.is_warned);
  EXPECT_NEAR(longer.x / jump(kRosenbrock, 21, 0.0, 1e-3).x, 1.0, 0.02);
  const Jump damped = jump(kPade, 21, 5e-3, 1e-6);
  EXPECT_FALSE(damped.is_warned);
  EXPECT_LT(std::abs(damped.x), 1e-8);
}

TEST(RodPade, NoStepAllocates) {
  GridBench bench(twisted(5e-3), 21);
  bench.inputs.gravity[0][0] = 9.81;
  bench.inputs.T[0] = {310.0, 10.0, 0.0, 0.0};
  const std::size_t before = rod_test::allocations;
  bench.step(1e-2);
  bench.inputs.T[0][0] = 500.0;  // approached in shares
  bench.step(1e-2);
  bench.solve_equilibrium();
  bench.outputs();
  EXPECT_EQ(rod_test::allocations, before);
}

TEST(RodPadeFmu, RefusesGridsOutOfRangeAndOtherStrains) {
  probe::Host host;
  for (int points : {-1, 4, 402}) {
    EXPECT_EQ(host.set_integer("grid_points", points), fmi2Error);
    EXPECT_TRUE(host.said({"grid_points = " + std::to_string(points), "5 to 401"}));
  }
  EXPECT_EQ(host.set_integer("grid_points", 5), fmi2OK);
  EXPECT_EQ(host.set_integer("grid_points", 401), fmi2OK);
  EXPECT_EQ(host.set_integer("method", static_cast<int>(Method::pade_euler)), fmi2OK);
  EXPECT_EQ(host.set_integer("strains", static_cast<int>(Strains::kirchhoff)), fmi2OK);
  EXPECT_EQ(fmi2EnterInitializationMode(host.fmu), fmi2OK);
  EXPECT_EQ(fmi2ExitInitializationMode(host.fmu), fmi2Error);
  EXPECT_TRUE(host.said({"pade_euler", "strains = 3", "cosserat"}));
}

TEST(RodPadeFmu, StepsRestoresAndFillsItsOutputs) {
  probe::Host host;
  host.set_integer("method", static_cast<int>(Method::pade_euler));
  host.set("gravity[1]", 9.81);
  host.set("body.retardation", 5e-3);
  host.start();
  const auto step = [&host](double t) { return fmi2DoStep(host.fmu, t, 1e-3, fmi2True); };
  EXPECT_EQ(step(0.0), fmi2OK);
  fmi2FMUstate state = nullptr;
  ASSERT_EQ(fmi2GetFMUstate(host.fmu, &state), fmi2OK);
  const auto values = [&host] {
    std::vector<double> all;
    for (const char* name : {"delta[1]", "N[1]", "tip.p[1]", "tip.euler[2]", "tip.v[1]", "energy.elastic", "energy.tca",
                             "energy.kinetic", "energy.gravity", "energy.dissipated", "shape.p[11,1]"})
      all.push_back(host.get(name));
    return all;
  };
  EXPECT_EQ(step(1e-3), fmi2OK);
  const std::vector<double> first = values();
  for (double value : first) EXPECT_NE(value, 0.0);
  ASSERT_EQ(fmi2SetFMUstate(host.fmu, state), fmi2OK);
  EXPECT_NE(values(), first);
  EXPECT_EQ(step(1e-3), fmi2OK);
  EXPECT_EQ(values(), first);
  fmi2FreeFMUstate(host.fmu, &state);
}
