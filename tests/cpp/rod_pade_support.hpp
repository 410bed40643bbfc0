// Test bench: the paper's scheme on a grid with its state and inputs.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "pade/grid_rod.hpp"
#include "rod_support.hpp"

namespace rod_test {

using namespace rod;

struct GridBench {
  GridBench(const Parameters& p, int points)
      : parameters(p),
        rod(p, Section::of(p), points),
        memory(GridState::size(points, rod.tcas())),
        state(memory.data(), points, rod.tcas()),
        scratch(rod.scratch()) {
    rod.set_unloaded(state);
  }

  Outputs outputs() {
    Outputs y;
    rod.outputs(loads_at(inputs, 0.0), state, y);
    return y;
  }
  bool solve_equilibrium() { return rod.solve_equilibrium(loads_at(inputs, 0.0), state, scratch).is_ok(); }
  void step(double h) { ASSERT_EQ(rod.step(inputs, h, state, scratch).reached, h); }

  /// u_i = lambda + kappa x r_i + r_i' at point k, and r_i.
  pade::Vector3 u(int k, int i, pade::Vector3& r) {
    const double s = parameters.length() * k / (rod.points() - 1);
    const double angle = parameters.tca[i].azimuth + parameters.tca[i].helix * s;
    r = parameters.tca[0].offset * pade::Vector3(std::cos(angle), std::sin(angle), 0.0);
    const pade::Vector3 slope = parameters.tca[i].helix * pade::Vector3(-r[1], r[0], 0.0);
    return state.strain(k).tail<3>() + state.strain(k).head<3>().cross(r) + slope;
  }

  Parameters parameters;
  Inputs inputs;
  GridRod rod;
  std::vector<double> memory;
  GridState state;
  GridScratch scratch;
};

/// Distance of two shapes and sets of displacements [m].
inline double difference(const Outputs& a, const Outputs& b) {
  double worst = 0.0;
  for (std::size_t m = 0; m < kShapeStations; ++m)
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(a.shape[m][c] - b.shape[m][c]));
  for (std::size_t i = 0; i < kTcas; ++i) worst = std::max(worst, std::abs(a.delta[i] - b.delta[i]));
  return worst;
}

/// Everything at once: helical TCAs, heat, gravity and tip loads that grow smoothly from rest.
template <class Stepper>
void shake(Inputs& u, double end, int steps, const Stepper& step) {
  const double h = end / steps;
  for (int i = 0; i < steps; ++i) {
    const double t = i * h;
    u.gravity[0] = {800.0 * t * t, 1600.0 * t, 1600.0, 0.0};
    u.tip_force[1] = {0.1 * t * t, 0.2 * t, 0.2, 0.0};
    u.tip_moment[2] = {1e-3 * t * t, 2e-3 * t, 2e-3, 0.0};
    u.T[0] = {298.15 + 4000.0 * t * t, 8000.0 * t, 8000.0, 0.0};
    step(h);
  }
  for (auto* load : {&u.gravity[0], &u.tip_force[1], &u.tip_moment[2], &u.T[0]})
    *load = {(*load)[0] + h * (*load)[1] + h * h / 2 * (*load)[2], 0.0, 0.0, 0.0};
}

inline Parameters twisted(double retardation) {
  Parameters p;
  p.set(&Segment::retardation, retardation);
  for (std::size_t i = 0; i < kTcas; ++i) p.tca[i].helix = i % 2 ? -20.0 : 30.0;
  return p;
}

inline Outputs shaken(const Parameters& p, int points, int steps) {
  GridBench bench(p, points);
  shake(bench.inputs, 0.04, steps, [&bench](double h) { bench.step(h); });
  return bench.outputs();
}

}  // namespace rod_test
