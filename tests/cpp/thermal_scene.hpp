// What the thermal tests and benchmarks share: scenes driven through the core, the independent reference, a truth for
// space.
#pragma once

#include <array>
#include <cmath>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "levels/full_level.hpp"
#include "levels/modal_level.hpp"
#include "mesh/heat_matrices.hpp"
#include "mesh/resolution.hpp"
#include "reduction/modal_model.hpp"

namespace thermal {

using core::value;

/// Throws std::runtime_error with the message of a failure: where a test or benchmark expects none.
inline void must(const Status& status) {
  if (!status.is_ok()) throw std::runtime_error(status.text());
}
template <class Value>
Value must(core::Result<Value> result) {
  must(result.status);
  return std::move(result.value);
}

/// Constant voltages, 1.5 i on TCA i (the scene `step` for three TCAs); surroundings as at the start.
inline Drive step_scene() {
  Drive drive;
  for (std::size_t i = 0; i < 3; ++i) drive.V[i][0] = 1.5 * static_cast<double>(i);
  return drive;
}

/// A level with its state.
class Trajectory {
 public:
  Trajectory(std::unique_ptr<HeatLevel> level, double tolerance = 1e-5)
      : level_(std::move(level)), tolerance_(tolerance), state(level_->state_size(), 0.0) {}

  void advance(const Drive& drive, double h) { must(level_->advance(state, drive, h, tolerance_)); }
  Observation observe(const Drive& drive) {
    Observation seen;
    must(level_->observe(state, drive, seen));
    return seen;
  }
  double max_rise() { return level_->max_rise(state); }
  bool exceeds(double rise) { return level_->exceeds(state, rise); }
  int unknowns() const { return level_->unknowns(); }

 private:
  std::unique_ptr<HeatLevel> level_;
  double tolerance_;

 public:
  std::vector<double> state;
};

inline std::unique_ptr<HeatLevel> level_of(const Parameters& p, const HeatMatrices& matrices) {
  switch (p.level) {
    case Level::full:
      return std::make_unique<FullLevel>(matrices, p);
    case Level::reduced:
      return make_modal_level(reduced(matrices, p.tolerance), p);
    default:
      return make_modal_level(lumped(matrices, reduced(matrices, 1e-4)), p);
  }
}

inline Trajectory run_of(const Parameters& p) { return {level_of(p, must(resolved_matrices(p))), p.tolerance}; }
inline Trajectory run_of(const Parameters& p, int order) {
  return {level_of(p, must(heat_matrices(p, order))), p.tolerance};
}

struct ReferenceRow {
  double t;                     // [s]
  std::array<double, 3> rises;  // over 25 degC [K]
};

/// Rows of data/thermal_step.csv.
inline std::vector<ReferenceRow> step_reference() {
  std::ifstream file(std::string(TCA_TEST_DATA) + "/thermal_step.csv");
  if (!file) throw std::runtime_error("thermal_step.csv is missing");
  std::vector<ReferenceRow> rows;
  for (std::string line; std::getline(file, line);) {
    ReferenceRow row{};
    char comma;
    std::istringstream fields(line);
    if (!(fields >> row.t >> comma >> row.rises[0] >> comma >> row.rises[1] >> comma >> row.rises[2])) continue;
    for (double& rise : row.rises) rise -= 25.0;
    rows.push_back(row);
  }
  return rows;
}

/// Largest difference of T_i between two runs under one drive, at times 2^k up to `last` and in steps of its 100th.
inline double largest_gap(Trajectory a, Trajectory b, const Drive& drive, double last) {
  double gap = 0.0, t = 0.0;
  for (int k = -30; k <= 60; ++k) {
    const double until = k < 0 ? 0.02 * last * std::pow(2.0, k / 2.0) : last * (k + 1) / 61.0;
    if (until <= t) continue;
    a.advance(drive, until - t);
    b.advance(drive, until - t);
    t = until;
    const Observation seen_a = a.observe(drive), seen_b = b.observe(drive);
    for (std::size_t i = 0; i < kMaxTcas; ++i) gap = std::max(gap, std::abs(seen_a.rise[i] - seen_b.rise[i]));
  }
  return gap;
}

/// alpha_T = 0.004, beta = 0.1
inline Parameters with_feedback(Level level) {
  Parameters p;
  p.level = level;
  p.tca.alpha_T = filled(0.004);
  p.tca.beta = filled(0.1);
  return p;
}

/// Smooth from the start, so that the order in time shows: V = (0.3, 0.6, 0.9) t, displacements of some millimetres.
inline Drive smooth_scene() {
  Drive drive;
  for (std::size_t i = 0; i < kMaxTcas; ++i) {
    drive.V[i] = {0.0, 0.3 * static_cast<double>(i + 1), 0.0, 0.0};
    drive.delta[i] = {1e-3, 5e-4, -1e-4, 0.0};
  }
  drive.ambient_rise = {0.0, 0.5, 0.0, 0.0};
  return drive;
}

/// The rest of a drive after s.
inline Drive later(const Drive& drive, double s) {
  const auto at = [s](const Cubic& c) { return core::shifted(c, s); };
  Drive rest;
  for (std::size_t i = 0; i < kMaxTcas; ++i) rest.V[i] = at(drive.V[i]), rest.delta[i] = at(drive.delta[i]);
  rest.ambient_rise = at(drive.ambient_rise);
  rest.air_speed = at(drive.air_speed);
  return rest;
}

inline double gap(const PerTca& a, const PerTca& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < kMaxTcas; ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

/// Largest error of T over the rows of the reference.
inline double against_reference(Trajectory run) {
  const Drive drive = step_scene();
  double t = 0.0, worst = 0.0;
  for (const ReferenceRow& row : step_reference()) {
    run.advance(drive, row.t - t);
    t = row.t;
    const Observation seen = run.observe(drive);
    for (std::size_t i = 0; i < 3; ++i) worst = std::max(worst, std::abs(seen.rise[i] - row.rises[i]));
  }
  return worst;
}

/// Rises after `last` [s] by a modal model in equal steps.
inline PerTca stepped(const ModalModel& model, const Parameters& p, const Drive& drive, double last, int steps,
                      double tolerance) {
  const auto level = make_modal_level(model, p);
  std::vector<double> state(level->state_size(), 0.0);
  const double h = last / steps;
  for (int n = 0; n < steps; ++n) must(level->advance(state, later(drive, h * n), h, tolerance));
  Observation seen;
  must(level->observe(state, drive, seen));
  return seen.rise;
}

}  // namespace thermal
