// What the rod costs and how accurate it is: bench_rod [kernels | grid | release | space | time], all by default.
// Times are medians of many calls; run it on an idle machine and compare ratios of one run. `space` and `time` are CSV.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>

#include "pade/grid_rod.hpp"
#include "rod_support.hpp"

using namespace rod;
using rod_test::bare_rod;
using rod_test::Bench;
using rod_test::RandomState;

namespace {

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Median time of one call [us], over batches.
template <class Call>
double cost(Call call) {
  constexpr int batches = 31, batch = 200;
  std::array<double, batches> times;
  for (double& time : times) {
    const double start = seconds();
    for (int i = 0; i < batch; ++i) call();
    time = (seconds() - start) / batch * 1e6;
  }
  std::nth_element(times.begin(), times.begin() + batches / 2, times.end());
  return times[batches / 2];
}

void kernels() {
  std::printf("planar order unknowns  residual  tangent  factor  newton step  static solve [us]\n");
  for (int row = 0; row < 2 * kMaxTerms; ++row) {
    Parameters p;
    p.planar = row >= kMaxTerms;
    p.set(&Segment::order, row % kMaxTerms);
    Bench bench(p);
    const int n = bench.rod.unknowns();
    const RandomState x(n, 1);
    const Loads loads = loads_at(bench.inputs, 0.0);
    Workspace work;
    Vector r;
    Matrix J;
    Eigen::PartialPivLU<Matrix> lu;
    const auto residual = [&] { bench.rod.residual(x.q.data(), x.v.data(), x.a.data(), loads, work, r); };
    const auto tangent = [&] { bench.rod.tangent(work, {1.0, 1e2, 1e4}, J); };
    const auto factor = [&] { lu.compute(J); };
    const double t_residual = cost(residual), t_tangent = cost(tangent), t_factor = cost(factor);
    const double t_newton = cost([&] { residual(), tangent(), factor(), r = lu.solve(r); });
    bench.inputs.gravity[0][0] = 9.81;
    const double t_static = cost([&] {
      bench.state.q.setZero();
      bench.solve_equilibrium();
    });
    std::printf("%6d %5d %8d %9.2f %8.2f %7.2f %12.2f %13.2f\n", p.planar, p.segment[0].order, n, t_residual, t_tangent,
                t_factor, t_newton, t_static);
  }
}

void grid() {
  std::printf("\npade_euler, damped release at 1 ms: points  one step  per point [us]\n");
  for (int points : {11, 21, 41, 81, 161}) {
    Parameters p = bare_rod();
    p.set(&Segment::retardation, 5e-3);
    const GridRod rod(p, Section::of(p), points);
    std::vector<double> memory(GridState::size(points, rod.tcas()));
    GridState state(memory.data(), points, rod.tcas());
    GridScratch scratch = rod.scratch();
    rod.set_unloaded(state);
    Inputs inputs;
    inputs.gravity[0][0] = 9.81;
    constexpr int steps = 200;
    double best = 1e9;
    for (int repeat = 0; repeat < 5; ++repeat) {
      rod.set_unloaded(state);
      const double start = seconds();
      for (int i = 0; i < steps; ++i) rod.step(inputs, 1e-3, state, scratch);
      best = std::min(best, (seconds() - start) / steps * 1e6);
    }
    std::printf("%43d %9.1f %10.2f\n", points, best, best / points);
  }
}

void release() {
  const auto rows = rod_test::read_csv("rod_release.csv");
  std::printf("\nrelease, 1 s: damping planar order tolerance  error at 0.1 s [um]  at 1 s [um]  times real time\n");
  for (int kind = 0; kind < 4; ++kind)
    for (int order : {2, 3, 4})
      for (double tolerance : {1e-1, 3e-2, 1e-2, 3e-3, 1e-3}) {
        Parameters p = bare_rod();
        const int damped = kind / 2;
        p.planar = kind % 2;
        p.set(&Segment::order, order);
        p.set(&Segment::retardation, damped ? 5e-3 : 0.0);
        double error[5], best = 1e9;
        for (int repeat = 0; repeat < 5; ++repeat) {
          Bench bench(p);
          bench.inputs.gravity[0][0] = 9.81;
          const double start = seconds();
          double t = 0.0;
          for (std::size_t k = 0; k < rows.size(); ++k) {
            step_rosenbrock(bench.rod, bench.inputs, rows[k][0] - t, tolerance, bench.state, bench.scratch);
            t = rows[k][0];
            const Outputs y = bench.outputs();
            error[k] =
                std::hypot(y.tip_p[2] * 1e3 - rows[k][1 + 2 * damped], y.tip_p[0] * 1e3 - rows[k][2 + 2 * damped]) *
                1e3;
          }
          best = std::min(best, seconds() - start);
        }
        std::printf("%s %17d %6d %9.0e %21.2f %12.2f %16.0f\n", damped ? "5 ms" : "none", p.planar, order, tolerance,
                    error[1], error[4], 1 / best);
      }
}

/// Equilibria against the order of the strains: the references of rod_static.csv, and the same at the highest order.
void space() {
  std::puts("# space: equilibria of rod_static.csv, largest error of tip and displacements");
  std::puts("order,unknowns,error_to_reference_m,error_to_order_7_m");
  const auto rows = rod_test::read_csv("rod_static.csv");
  const auto solve = [&rows](int order, std::size_t row) {
    Parameters p;
    p.set(&Segment::order, order);
    Bench bench(p);
    for (int c = 0; c < 3; ++c) bench.inputs.gravity[c][0] = rows[row][1 + c];
    for (int i = 0; i < 3; ++i) bench.inputs.T[i][0] = rows[row][4 + i] + 273.15;
    bench.solve_equilibrium();
    const Outputs y = bench.outputs();
    return std::array{y.tip_p[0], y.tip_p[1], y.tip_p[2], y.delta[0], y.delta[1], y.delta[2]};
  };
  for (int order = 0; order <= kMaxOrder; ++order) {
    double to_reference = 0.0, to_best = 0.0;
    for (std::size_t row = 0; row < rows.size(); ++row) {
      const auto computed = solve(order, row), best = solve(kMaxOrder, row);
      for (int c = 0; c < 6; ++c) {
        to_reference = std::max(to_reference, std::abs(computed[c] - rows[row][(c < 3 ? 7 : 10) + c]));
        to_best = std::max(to_best, std::abs(computed[c] - best[c]));
      }
    }
    std::printf("%d,%d,%.3e,%.3e\n", order, 6 * (order + 1), to_reference, to_best);
  }
}

/// The damped release to 0.1 s against the step length, at strains of order 3, whose own error a fine run shares.
void time() {
  std::puts("# time: damped release, tip at 0.1 s against a run at tolerance 1e-11");
  std::puts("method,step_s,error_m");
  Parameters p = bare_rod();
  p.set(&Segment::order, 3);
  p.set(&Segment::retardation, 5e-3);
  const auto tip = [&p](auto step, int steps) {
    Bench bench(p);
    bench.inputs.gravity[0][0] = 9.81;
    for (int i = 0; i < steps; ++i) step(bench, 0.1 / steps);
    return bench.outputs().tip_p;
  };
  const auto rosenbrock = [](Bench& b, double h) { step_rosenbrock(b.rod, b.inputs, h, 1e-11, b.state, b.scratch); };
  const Triple truth = tip(rosenbrock, 1);
  const auto print = [&](const char* name, auto step) {
    for (int steps : {5, 10, 20, 40, 80, 160, 320}) {
      const Triple computed = tip(step, steps);
      std::printf("%s,%g,%.3e\n", name, 0.1 / steps, std::hypot(computed[0] - truth[0], computed[2] - truth[2]));
    }
  };
  print("backward_euler", [](Bench& b, double h) { step_backward_euler(b.rod, b.inputs, h, b.state, b.scratch); });
  print("midpoint", [](Bench& b, double h) { step_midpoint(b.rod, b.inputs, h, b.state, b.scratch); });
  print("rosenbrock", [](Bench& b, double h) {
    b.state.next_step = h;
    step_rosenbrock(b.rod, b.inputs, h, 1e9, b.state, b.scratch);  // a tolerance that accepts the step asked for
  });
}

}  // namespace

int main(int argc, char** argv) {
  const auto wanted = [&](const char* name) { return argc < 2 || std::strcmp(argv[1], name) == 0; };
  if (wanted("kernels")) kernels();
  if (wanted("grid")) grid();
  if (wanted("release")) release();
  if (wanted("space")) space();
  if (wanted("time")) time();
}
