// What the rod costs: kernels and solves against the order, and the release of the bare rod against its error.
// Times are medians of many calls; run it on an idle machine and compare ratios of one run.
#include <algorithm>
#include <chrono>
#include <cstdio>

#include "pade.hpp"
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
  std::printf("order unknowns  residual  tangent  factor  newton step  static solve [us]\n");
  for (int order = 0; order <= highest_order; ++order) {
    Parameters p;
    p.order = order;
    Bench bench(p);
    const int n = bench.rod.unknowns();
    const RandomState x(n, 1);
    const Loads loads = loads_at(bench.inputs, 0.0);
    Work work;
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
      bench.settle();
    });
    std::printf("%5d %8d %9.2f %8.2f %7.2f %12.2f %13.2f\n", order, n, t_residual, t_tangent, t_factor, t_newton,
                t_static);
  }
}

void grid() {
  std::printf("\npade_euler, damped release at 1 ms: points  one step  per point [us]\n");
  for (int points : {11, 21, 41, 81, 161}) {
    Parameters p = bare_rod();
    p.body_retardation = 5e-3;
    const GridRod rod(p, Section::of(p), points);
    std::vector<double> memory(GridState::size(points));
    GridState state(memory.data(), points);
    GridScratch scratch = rod.scratch();
    rod.straighten(state);
    Inputs inputs;
    inputs.gravity[0][0] = 9.81;
    constexpr int steps = 200;
    double best = 1e9;
    for (int repeat = 0; repeat < 5; ++repeat) {
      rod.straighten(state);
      const double start = seconds();
      for (int i = 0; i < steps; ++i) rod.step(inputs, 1e-3, state, scratch);
      best = std::min(best, (seconds() - start) / steps * 1e6);
    }
    std::printf("%43d %9.1f %10.2f\n", points, best, best / points);
  }
}

void release() {
  const auto rows = rod_test::read_csv("rod_release.csv");
  std::printf("\nrelease, 1 s: damping order tolerance  error at 0.1 s [um]  at 1 s [um]  times real time\n");
  for (int damped : {0, 1})
    for (int order : {2, 3, 4})
      for (double tolerance : {1e-1, 3e-2, 1e-2, 3e-3, 1e-3}) {
        Parameters p = bare_rod();
        p.order = order;
        p.body_retardation = damped ? 5e-3 : 0.0;
        double error[5], best = 1e9;
        for (int repeat = 0; repeat < 5; ++repeat) {
          Bench bench(p);
          bench.inputs.gravity[0][0] = 9.81;
          const double start = seconds();
          double t = 0.0;
          for (std::size_t k = 0; k < rows.size(); ++k) {
            step_rosenbrock(bench.rod, bench.inputs, rows[k][0] - t, tolerance, bench.state, bench.scratch);
            t = rows[k][0];
            const Outputs y = bench.look();
            error[k] =
                std::hypot(y.tip_p[2] * 1e3 - rows[k][1 + 2 * damped], y.tip_p[0] * 1e3 - rows[k][2 + 2 * damped]) *
                1e3;
          }
          best = std::min(best, seconds() - start);
        }
        std::printf("%s %12d %9.0e %21.2f %12.2f %16.0f\n", damped ? "5 ms" : "none", order, tolerance, error[1],
                    error[4], 1 / best);
      }
}

}  // namespace

int main() {
  kernels();
  grid();
  release();
}
