// Test bench: a rod with its state and inputs; random states, finite differences and reference data.
#pragma once

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "integration/integrator.hpp"
#include "physics/section.hpp"

namespace rod {
inline constexpr std::size_t kTcas = 3;  // of the default body
}

namespace rod_test {

/// Calls of operator new so far, in the whole test program.
extern std::size_t allocations;

struct Bench {
  explicit Bench(const rod::Parameters& p)
      : parameters(p),
        inputs(inputs_of(p)),
        owner(rod::make_rod(p)),
        rod(*owner),
        memory(rod::State::size(rod.unknowns())),
        state(memory.data(), rod.unknowns()) {}

  rod::Outputs outputs() {
    rod::Outputs y;
    const rod::Loads loads = rod::loads_at(inputs, 0.0);
    rod.residual(state.q.data(), state.v.data(), state.a.data(), loads, scratch.newton.work, scratch.r);
    rod.kinematics(state.q.data(), state.v.data(), loads, scratch.newton.work);
    rod.outputs(state.q.data(), state.v.data(), loads, scratch.newton.work, y);
    return y;
  }
  static rod::Inputs inputs_of(const rod::Parameters& p) {
    rod::Inputs inputs;
    inputs.tcas = p.tcas;
    inputs.stations = p.has_load ? rod::kShapeStations : 0;
    return inputs;
  }
  bool solve_equilibrium() { return rod::solve_equilibrium(rod, rod::loads_at(inputs, 0.0), state, scratch).is_ok(); }

  rod::Parameters parameters;
  rod::Inputs inputs;
  std::unique_ptr<const rod::Rod> owner;
  const rod::Rod& rod;
  std::vector<double> memory;
  rod::State state;
  rod::Scratch scratch;
};

/// The bare rod of the release: no TCAs, rho 1070, shear factor 27/28.
inline rod::Parameters bare_rod() {
  rod::Parameters p;
  p.set(&rod::Tca::law, rod::Law::measured);
  p.set(&rod::Tca::stiffness, 0.0);
  p.set(&rod::Segment::rho, 1070.0);
  p.set(&rod::Segment::shear_factor, 27.0 / 28.0);
  return p;
}

/// A random state that bends the rod by some radians and moves it fast.
struct RandomState {
  RandomState(int n, unsigned seed) : q(n), v(n), a(n) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int j = 0; j < n; ++j)
      q[j] = 0.4 * uniform(random), v[j] = 5.0 * uniform(random), a[j] = 200.0 * uniform(random);
  }
  rod::Vector q, v, a;
};

/// What is between `exact` and the slope of r at 0, by central differences of order 4. The best of three steps counts:
/// a residual may turn sharply nearby.
inline double error(const std::function<rod::Vector(double)>& r, const rod::Vector& exact, double widest = 1e-3) {
  double least = INFINITY;
  for (double e : {widest, widest / 3.0, widest / 10.0}) {
    const rod::Vector slope = (8.0 * (r(e) - r(-e)) - (r(2 * e) - r(-2 * e))) / (12.0 * e);
    least = std::min(least, (slope - exact).norm());
  }
  return least;
}

/// Rows of a CSV file of tests/data, without comments and header; cells that are no numbers read as 0.
inline std::vector<std::vector<double>> read_csv(const std::string& name) {
  std::ifstream file(std::string(TCA_TEST_DATA) + "/" + name);
  std::vector<std::vector<double>> rows;
  std::string line;
  bool header = true;
  while (std::getline(file, line)) {
    if (line.empty() || line[0] == '#') continue;
    if (std::exchange(header, false)) continue;
    std::istringstream cells(line);
    std::vector<double> row;
    for (std::string cell; std::getline(cells, cell, ',');) {
      char* end = nullptr;
      row.push_back(std::strtod(cell.c_str(), &end));
    }
    rows.push_back(row);
  }
  return rows;
}

}  // namespace rod_test
