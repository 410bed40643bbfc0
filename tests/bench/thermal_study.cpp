// Studies of the heat model, as CSV on standard output: bench_thermal [mesh | reduction | feedback | integrators |
// cost], all by default.
#include <malloc.h>

#include <cstdio>
#include <cstring>
#include <ctime>
#include <memory>

#include "thermal_bdf.hpp"
#include "thermal_scene.hpp"

namespace thermal {
namespace {

constexpr double kFine = 1e-7;  // tolerance of reductions whose error must not show

Trajectory fine_run(int order) {
  Parameters p;
  p.tolerance = kFine;
  return run_of(p, order);
}

void mesh() {
  std::puts("# mesh: scene step, T_i at the reference's times and against the same scene at order 10");
  std::puts("order,unknowns,error_to_reference_K,error_to_order_10_K");
  for (int order = 2; order <= 8; ++order) {
    const auto n = must(heat_matrices({}, order)).size();
    std::printf("%d,%ld,%.3e,%.3e\n", order, static_cast<long>(n), against_reference(fine_run(order)),
                largest_gap(fine_run(order), fine_run(10), step_scene(), 30.0));
  }
}

void reduction() {
  std::puts(
      "# reduction: scene step to 300 s on one mesh, error against that mesh unreduced, the bound published at the "
      "end");
  std::puts("tolerance,states,error_K,bound_K,bound_over_error");
  const Drive drive = step_scene();
  for (double tolerance : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
    Parameters p, fine;
    p.tolerance = tolerance;
    fine.tolerance = 1e-8;
    Trajectory run = run_of(p, 5);
    const double error = largest_gap(run_of(p, 5), run_of(fine, 5), drive, 300.0);
    run.advance(drive, 300.0);
    const double bound = run.observe(drive).bound;
    std::printf("%g,%d,%.3e,%.3e,%.1f\n", tolerance, run.unknowns(), error, bound, bound / error);
  }
}

template <class Task>
double microseconds(int repeats, Task task) {
  double least = 1e300;
  for (int round = 0; round < 7; ++round) {
    const std::clock_t start = std::clock();  // of the processor: others on the machine do not count
    for (int i = 0; i < repeats; ++i) task(i);
    least = std::min(least, 1e6 / CLOCKS_PER_SEC * static_cast<double>(std::clock() - start) / repeats);
  }
  return least;
}

/// Level `full` with its counts, as Bdf.
class Esdirk {
 public:
  Esdirk(const HeatMatrices& matrices, const Parameters& p) : level_(matrices, p), state_(level_.state_size(), 0.0) {}
  void advance(const Drive& drive, double h, double tolerance) { must(level_.advance(state_, drive, h, tolerance)); }
  Observation observe(const Drive& drive) {
    Observation seen;
    must(level_.observe(state_, drive, seen));
    return seen;
  }
  const FullSystem::Counts& counts() const { return level_.counts(); }

 private:
  FullLevel level_;
  std::vector<double> state_;
};

/// One line of a study: 10 s of the scene in macro steps of that length [s].
template <class Make>
void integrate(const char* name, double macro, double tolerance, Trajectory truth, Make make) {
  const Drive drive = step_scene();
  const int steps = static_cast<int>(std::lround(10.0 / macro));
  auto run = make();
  double worst = 0.0;
  for (int n = 0; n < steps; ++n) {
    truth.advance(drive, macro);
    run->advance(drive, macro, tolerance);
    const Observation seen = run->observe(drive), expected = truth.observe(drive);
    for (std::size_t i = 0; i < 3; ++i) worst = std::max(worst, std::abs(seen.rise[i] - expected.rise[i]));
  }
  const double time = microseconds(1, [&](int) {
    const auto again = make();
    for (int n = 0; n < steps; ++n) again->advance(drive, macro, tolerance);
  });
  const FullSystem::Counts& work = run->counts();
  std::printf("%s,%g,%g,%.2e,%ld,%ld,%ld,%ld,%.1f\n", name, macro, tolerance, worst, work.steps, work.slopes,
              work.factorisations, work.solves, 1e-3 * time);
}

void integrators() {
  std::puts("# integrators of level full: scene step to 10 s, order 4, against the same mesh exact in time");
  std::puts("integrator,macro_step_s,tolerance,error_K,steps,slopes,factorisations,solves,time_ms");
  const Parameters p;
  const HeatMatrices m = must(heat_matrices(p, 4));
  for (double macro : {0.1, 1.0})
    for (double tolerance : {1e-4, 1e-5, 1e-6}) {
      const auto line = [&](const char* name, auto make) { integrate(name, macro, tolerance, fine_run(4), make); };
      line("esdirk", [&] { return std::make_unique<Esdirk>(m, p); });
      line("bdf with history", [&] { return std::make_unique<Bdf>(m, p, true); });
      line("bdf begun anew", [&] { return std::make_unique<Bdf>(m, p, false); });
    }
}

/// Feedback alpha_T = 0.004, beta = 0.1 as the collocation has it, undivided: its order in the step length.
void feedback() {
  std::puts("# feedback: smooth scene to 8 s, one collocation per step, against 128 steps");
  std::puts("level,step_s,error_K");
  constexpr double kNoHalving = 1e300;
  const HeatMatrices m = must(heat_matrices({}, 3));
  const ModalModel small = reduced(m, 1e-3), net = lumped(m, small);
  for (const auto& [name, model] : {std::pair{"reduced", &small}, {"lumped", &net}}) {
    const auto rises = [&](int steps) {
      return stepped(*model, with_feedback(Level::reduced), smooth_scene(), 8.0, steps, kNoHalving);
    };
    const PerTca truth = rises(128);
    for (int steps : {1, 2, 4, 8}) std::printf("%s,%g,%.3e\n", name, 8.0 / steps, gap(rises(steps), truth));
  }
}

void cost() {
  std::puts("# cost: processor time, least of 7 rounds, steps of 0.1 s, default tolerance");
  std::puts("level,unknowns,build_ms,step_us,observe_us,scene_30s_ms,memory_KiB");
  const Drive drive = step_scene();
  Drive cubic = drive;
  for (std::size_t i = 0; i < 3; ++i) cubic.V[i] = {1.0, 0.1, 0.01, 0.001};
  cubic.ambient_rise = {1.0, 0.1, 0.0, 0.0};
  for (const auto& [name, level, feedback] : {std::tuple{"lumped", Level::lumped, false},
                                              {"reduced", Level::reduced, false},
                                              {"reduced with feedback", Level::reduced, true},
                                              {"full", Level::full, false},
                                              {"full with feedback", Level::full, true}}) {
    Parameters p;
    p.level = level;
    if (feedback) p.tca.alpha_T = filled(0.004), p.tca.beta = filled(0.1);
    const double build = microseconds(1, [&](int) { run_of(p); });
    const std::size_t before = mallinfo2().uordblks;
    Trajectory run = run_of(p);
    const double memory = static_cast<double>(mallinfo2().uordblks - before) / 1024.0;
    const int repeats = level == Level::full ? 20 : 2000;
    const double step = microseconds(repeats, [&](int i) { run.advance(i % 2 ? cubic : drive, 0.1); });
    double sink = 0.0;
    const double observe = microseconds(repeats, [&](int) { sink += run.observe(drive).rise[0]; });
    const double scene = microseconds(1, [&](int) {
      std::fill(run.state.begin(), run.state.end(), 0.0);
      for (int i = 0; i < 300; ++i) run.advance(drive, 0.1), sink += run.observe(drive).rise[0];
    });
    std::printf("%s,%d,%.2f,%.3f,%.3f,%.2f,%.0f%s\n", name, run.unknowns(), build * 1e-3, step, observe, scene * 1e-3,
                memory, sink == 0.0 ? "!" : "");
  }
}

}  // namespace
}  // namespace thermal

int main(int argc, char** argv) {
  const auto wanted = [&](const char* name) { return argc < 2 || std::strcmp(argv[1], name) == 0; };
  if (wanted("mesh")) thermal::mesh();
  if (wanted("reduction")) thermal::reduction();
  if (wanted("feedback")) thermal::feedback();
  if (wanted("integrators")) thermal::integrators();
  if (wanted("cost")) thermal::cost();
}
