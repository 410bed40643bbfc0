// Time integration: orders, known motions, energy, no allocation in a step.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <new>

#include "integration/bdf.hpp"
#include "rod_support.hpp"

using namespace rod;
using rod_test::bare_rod;
using rod_test::Bench;

std::size_t rod_test::allocations = 0;
using rod_test::allocations;

// Everything that is allocated comes by here, operator new and Eigen's arrays too (glibc).
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}
}

namespace {

constexpr double loose = 1e9;  // a tolerance that accepts every step

StepOutcome advance(Bench& bench, Method method, double h, double tolerance) {
  switch (method) {
    case Method::backward_euler:
      return step_backward_euler(bench.rod, bench.inputs, h, bench.state, bench.scratch);
    case Method::midpoint:
      return step_midpoint(bench.rod, bench.inputs, h, bench.state, bench.scratch);
    case Method::rosenbrock_3:
      return step_rosenbrock_3(bench.rod, bench.inputs, h, tolerance, bench.state, bench.scratch);
    default:
      break;
  }
  return step_rosenbrock(bench.rod, bench.inputs, h, tolerance, bench.state, bench.scratch);
}

/// A smooth start: the rod at rest in equilibrium, then heated and shaken by polynomials in time.
Vector shaken(Method method, double retardation, int steps) {
  Parameters p;
  p.set(&Segment::order, 0);
  p.set(&Segment::retardation, retardation);
  Bench bench(p);
  bench.inputs.gravity[0][0] = 4.0;
  EXPECT_TRUE(bench.solve_equilibrium());
  const double end = 0.08, h = end / steps;
  for (int i = 0; i < steps; ++i) {
    const double t =
        i * h;  // gravity_x = 4 + 800 t^2, T_1 = T_0 + 4000 t^2: no jump in the second derivative but at t = 0
    bench.inputs.gravity[0] = {4.0 + 800.0 * t * t, 1600.0 * t, 1600.0, 0.0};
    bench.inputs.T[0] = {p.T_0 + 4000.0 * t * t, 8000.0 * t, 8000.0, 0.0};
    bench.state.next_step = h;
    EXPECT_EQ(advance(bench, method, h, loose).reached, h);
  }
  return bench.state.q;
}

}  // namespace

TEST(RodDynamics, EveryMethodHasItsOrder) {
  // Stiff damping costs RODAS5P one order, as its author reports for parabolic problems.
  const struct {
    Method method;
    double retardation, order;
    int steps;
  } cases[] = {{Method::backward_euler, 0.0, 1, 1280}, {Method::backward_euler, 5e-3, 1, 320},
               {Method::midpoint, 0.0, 2, 320},        {Method::midpoint, 5e-3, 2, 160},
               {Method::rosenbrock, 0.0, 5, 80},       {Method::rosenbrock, 5e-3, 4, 80},
               {Method::rosenbrock_3, 0.0, 3, 320},    {Method::rosenbrock_3, 5e-3, 3, 160}};
  for (const auto& [method, retardation, order, steps] : cases) {
    const Vector truth = shaken(Method::rosenbrock, retardation, 1280);
    const double coarse = (shaken(method, retardation, steps) - truth).norm();
    const double fine = (shaken(method, retardation, 2 * steps) - truth).norm();
    const double observed = std::log2(coarse / fine);
    EXPECT_GT(observed, order - 0.2) << "method " << static_cast<int>(method) << ", retardation " << retardation;
    EXPECT_LT(observed, order + 1.0) << "method " << static_cast<int>(method) << ", retardation " << retardation;
  }
}

TEST(RodDynamics, DampedReleaseAgainstTheReference) {
  Parameters p = bare_rod();
  p.set(&Segment::retardation, 5e-3);
  p.set(&Segment::order, 5);
  Bench bench(p);
  bench.inputs.gravity[0][0] = 9.81;
  double t = 0.0;
  for (const auto& row : rod_test::read_csv("rod_release.csv")) {
    ASSERT_EQ(advance(bench, Method::rosenbrock, row[0] - t, 1e-7).reached, row[0] - t);
    t = row[0];
    const Outputs y = bench.outputs();
    EXPECT_LT(std::hypot(y.tip_p[2] * 1e3 - row[3], y.tip_p[0] * 1e3 - row[4]), 2e-4) << "t = " << t;  // mm
  }
}

TEST(RodDynamics, UndampedReleaseAgainstTheReference) {
  Parameters p = bare_rod();
  p.set(&Segment::order, 7);
  Bench bench(p);
  bench.inputs.gravity[0][0] = 9.81;
  double t = 0.0;
  for (const auto& row : rod_test::read_csv("rod_release.csv")) {
    ASSERT_EQ(advance(bench, Method::rosenbrock, row[0] - t, 1e-5).reached, row[0] - t);
    t = row[0];
    const Outputs y = bench.outputs();
    // A sudden release excites every wave; the polynomials of degree 7 resolve them to a micrometre or two.
    EXPECT_LT(std::hypot(y.tip_p[2] * 1e3 - row[1], y.tip_p[0] * 1e3 - row[2]), row[0] < 0.3 ? 2e-3 : 2e-2)
        << "t = " << t;
  }
}

TEST(RodDynamics, EnergyIsKeptOrAccountedFor) {
  for (double retardation : {0.0, 5e-3}) {
    Parameters p;  // with its TCAs: bent by a force, let go
    p.set(&Segment::order, 2);
    p.set(&Segment::retardation, retardation);
    Bench bench(p);
    bench.inputs.tip_force[0][0] = 3e-3;
    ASSERT_TRUE(bench.solve_equilibrium());
    bench.inputs.tip_force[0][0] = 0.0;
    const auto total = [&bench] {
      const Outputs y = bench.outputs();
      return y.energy_kinetic + y.energy_elastic + y.energy_tca + bench.state.dissipated;
    };
    const double before = total();
    ASSERT_EQ(advance(bench, Method::rosenbrock, 0.5, 1e-9).reached, 0.5);
    // Kept to 1e-8 per second; the heat of damping is one more integral, with an error of its own.
    EXPECT_NEAR(total(), before, (retardation > 0.0 ? 1e-7 : 0.5e-8) * before) << "retardation " << retardation;
    EXPECT_EQ(bench.state.dissipated > 0.5 * before, retardation > 0.0);
  }
}

TEST(RodDynamics, MidpointDoesNotDriftInEnergy) {
  Parameters p = bare_rod();
  p.set(&Segment::order, 1);
  Bench bench(p);
  bench.inputs.gravity[0][0] = 9.81;
  double worst = 0.0, reach = 0.0;
  for (int i = 0; i < 2000; ++i) {
    ASSERT_EQ(advance(bench, Method::midpoint, 1e-3, 0.0).reached, 1e-3);
    const Outputs y = bench.outputs();
    reach = std::max(reach, y.energy_elastic);
    worst = std::max(worst, std::abs(y.energy_kinetic + y.energy_elastic + y.energy_gravity));
  }
  EXPECT_LT(worst, 1e-2 * reach);
}

TEST(RodDynamics, BackwardEulerDampsAndMidpointDoesNot) {
  const auto swing = [](Method method) {  // elastic plus kinetic energy after two seconds of free vibration
    Parameters p = bare_rod();
    p.set(&Segment::order, 1);
    Bench bench(p);
    bench.inputs.tip_force[0][0] = 1e-4;
    EXPECT_TRUE(bench.solve_equilibrium());
    bench.inputs.tip_force[0][0] = 0.0;
    const double before = bench.outputs().energy_elastic;
    for (int i = 0; i < 400; ++i) advance(bench, method, 5e-3, 0.0);
    const Outputs y = bench.outputs();
    return (y.energy_elastic + y.energy_kinetic) / before;
  };
  EXPECT_LT(swing(Method::backward_euler), 1e-3);
  EXPECT_GT(swing(Method::midpoint), 0.95);
}

TEST(RodDynamics, FirstFrequencyOfTheBareRod) {
  // Timoshenko clamped-free: 5.0149 Hz. Count the crossings of a small free vibration.
  Parameters p = bare_rod();
  p.set(&Segment::order, 5);
  Bench bench(p);
  bench.inputs.tip_force[0][0] = 1e-6;
  ASSERT_TRUE(bench.solve_equilibrium());
  bench.inputs.tip_force[0][0] = 0.0;
  double last = bench.outputs().tip_p[0], first = -1.0, latest = 0.0;
  int crossings = 0;
  const double h = 1e-3;
  for (int i = 0; i < 3000; ++i) {
    ASSERT_EQ(advance(bench, Method::rosenbrock, h, 1e-6).reached, h);
    const double x = bench.outputs().tip_p[0];
    if (last > 0.0 && x <= 0.0) {
      latest = (i + last / (last - x)) * h;
      if (first < 0.0)
        first = latest;
      else
        ++crossings;
    }
    last = x;
  }
  EXPECT_NEAR(crossings / (latest - first), 5.0149, 5e-3);
}

TEST(RodDynamics, NoStepAllocates) {
  Parameters p;
  p.set(&Segment::retardation, 5e-3);
  Parameters body(4, 2);
  body.set(&Segment::retardation, 5e-3);
  body.segment[1].radius_end = 3e-3;
  for (const Parameters& each : {p, body}) {
    Bench bench(each);
    bench.inputs.gravity[0][0] = 9.81;
    bench.inputs.T[0] = {310.0, 10.0, 0.0, 0.0};
    const auto work = [&bench] {
      bench.solve_equilibrium();
      for (Method method : {Method::backward_euler, Method::midpoint, Method::rosenbrock, Method::rosenbrock_3})
        EXPECT_EQ(advance(bench, method, 1e-2, 1e-6).reached, 1e-2);
    };
    const std::size_t start = allocations;
    work();  // the first step sizes the scratch
    EXPECT_GT(allocations, start);
    const std::size_t before = allocations;
    work();
    EXPECT_EQ(allocations, before) << each.segments;
  }
}

TEST(RodDynamics, BdfReachesItsToleranceAndRestartsHonestly) {
  const auto tip = [](auto step) {
    Parameters p = bare_rod();
    p.set(&Segment::retardation, 5e-3);
    p.set(&Segment::order, 2);
    Bench bench(p);
    bench.inputs.gravity[0][0] = 9.81;
    for (int i = 0; i < 10; ++i) EXPECT_EQ(step(bench, 0.02).reached, 0.02);
    return std::pair(bench.outputs().tip_p[0], bench.state.dissipated);
  };
  const auto truth = tip([](Bench& b, double h) { return advance(b, Method::rosenbrock, h, 1e-9); });
  double before = 1e-2;
  for (double tolerance : {1e-3, 1e-5, 1e-7}) {
    Bdf bdf(18);
    const auto computed =
        tip([&](Bench& b, double h) { return bdf.step(b.rod, b.inputs, h, tolerance, b.state, b.scratch); });
    const double error = std::abs(computed.first - truth.first);
    EXPECT_LT(error, 10 * tolerance * 0.04);
    EXPECT_LT(error, before);
    EXPECT_NEAR(computed.second, truth.second, 30 * tolerance * truth.second);
    Bdf another(18);
    const auto again =
        tip([&](Bench& b, double h) { return another.step(b.rod, b.inputs, h, tolerance, b.state, b.scratch); });
    EXPECT_EQ(computed, again) << "a fresh integrator must do the same from the same states";
    before = error;
  }
}

TEST(RodDynamics, AbsurdTensionsAreRefusedQuickly) {
  for (double guess : {1e3, 1e70}) {
    for (Method method : {Method::backward_euler, Method::midpoint, Method::rosenbrock, Method::rosenbrock_3}) {
      Parameters p;
      p.closure = Closure::exchanged;
      Bench bench(p);
      for (Polynomial& delta : bench.inputs.delta_guess) delta[0] = guess;
      const StepOutcome result = advance(bench, method, 0.1, 1e-6);
      EXPECT_TRUE(bench.rod.is_admissible(bench.state.q.data()));
      EXPECT_LT(result.reached, 0.1);
      EXPECT_FALSE(result.status.is_ok());
    }
  }
}

TEST(RodDynamics, ViolentStepsEndAndStayFinite) {
  for (Method method : {Method::backward_euler, Method::midpoint, Method::rosenbrock}) {
    Parameters p;
    p.set(&Segment::order, 2);
    p.set(&Segment::retardation, 5e-3);
    Bench bench(p);
    bench.inputs.tip_force[0][0] = 5.0;
    bench.inputs.gravity[2][0] = -1000.0;
    bench.inputs.T[0][0] = 600.0;
    const double h = method == Method::rosenbrock ? 0.1 : 10.0;
    const StepOutcome result = advance(bench, method, h, 1e-4);
    EXPECT_TRUE(bench.state.q.allFinite() && bench.state.v.allFinite());
    EXPECT_TRUE(result.reached == h || !result.status.is_ok());
  }
}
