// The heat model at the ends of its parameters' ranges: insulated sections, thin TCAs, resistances that vanish, hosts
// that diverge, steps of absurd length; and what is said where a search ends at its cap.
#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <cmath>
#include <string>

#include "fmu/thermal_model.hpp"
#include "mesh/resolution.hpp"
#include "thermal_scene.hpp"

namespace thermal {
namespace {

/// A model as the runtime drives it, with the warnings that it gave.
struct Bench {
  explicit Bench(const Parameters& parameters) {
    data().parameters = parameters;
    model.warn = [this](std::string_view text) { warnings.emplace_back(text); };
    fmu::require(model.build());
    fmu::require(model.initialise(0.0));
  }
  Data& data() { return *reinterpret_cast<Data*>(model.data().data()); }
  void step(double h) {
    fmu::require(model.step(t, h).status);
    t += h;
    fmu::require(model.evaluate(t));
    fmu::require(model.evaluate_on_demand(t, ~0u));
  }
  ThermalModel model;
  std::vector<std::string> warnings;
  double t = 0.0;
};

Parameters section(Level level, double h, double k) {
  Parameters p;
  p.level = level;
  p.h = h;
  p.body.k = k;
  p.tca.k = filled(k);
  return p;
}

/// Exactly, whatever the section: Q_loss = sum P and T_surface - T_ambient = sum P / (2 pi R L h).
TEST(Insulated, SteadyStatesBalanceDownToTheLeastTransfer) {
  for (const auto& [h, k] : {std::pair{1e-4, 0.19}, std::pair{1e-9, 0.19}, std::pair{1e-6, 1e4}, std::pair{1e-9, 1e6}})
    for (Level level : {Level::lumped, Level::reduced}) {
      Bench bench(section(level, h, k));
      bench.data().V[0][0] = 1e-3;
      bench.step(1e25);
      const Data& d = bench.data();
      EXPECT_NEAR(d.Q_loss / d.P[0], 1.0, 1e-9) << "h " << h << ", k " << k;
      EXPECT_NEAR((d.T_surface - 298.15) * 2.0 * M_PI * 5e-3 * 0.04 * h / d.P[0], 1.0, 1e-9);
    }
}

TEST(Insulated, ReducedKeepsTheToleranceInARun) {
  for (const double h : {1e-2, 1e-4, 1e-9}) {
    Parameters p = section(Level::reduced, h, 0.19), exact = section(Level::full, h, 0.19);
    exact.tolerance = 1e-6;
    Bench bench(p), full(exact);
    for (Bench* each : {&bench, &full}) each->data().V[0][0] = 2.0;
    for (const double until : {0.1, 1.0, 30.0}) {
      for (Bench* each : {&bench, &full}) each->step(until - each->t);
      const double rise = full.data().T[0] - 298.15, error = std::abs(bench.data().T[0] - full.data().T[0]);
      EXPECT_LT(error, 5e-5 * std::max(rise, 25.0)) << "h " << h << ", t " << until;
      EXPECT_LT(error, bench.data().reduction_bound + 2.0 * p.tolerance * 100.0);
    }
    EXPECT_LT(bench.data().reduction_bound, 1e-4 * (full.data().T[0] - 298.15));
    EXPECT_TRUE(bench.warnings.empty()) << bench.warnings[0];
    // An insulated section stores what it is given.
    EXPECT_NEAR(bench.data().E_stored / (4.0 / 6.9 * 30.0), 1.0, 1e-3);
  }
}

TEST(Insulated, FullConservesHeatWhereConvectionIsBelowTheRoundingOfConduction) {
  Bench bench(section(Level::full, 1e-6, 1e4));
  bench.data().parameters.tolerance = 1e-3;
  bench.data().V[0][0] = 1e-3;
  bench.step(1e12);
  EXPECT_NEAR(bench.data().Q_loss / bench.data().P[0], 1.0, 1e-6);
}

TEST(Accuracy, WhatASearchMissedIsSaidInEveryRun) {
  Parameters p;
  p.level = Level::lumped;
  Bench lumped(p);
  ASSERT_EQ(lumped.warnings.size(), 1u);
  EXPECT_NE(lumped.warnings[0].find("tolerance asks for 1e-05"), std::string::npos) << lumped.warnings[0];
  lumped.model.warnings_given = 0;  // as the runtime does for another run
  fmu::require(lumped.model.initialise(0.0));
  EXPECT_EQ(lumped.warnings.size(), 2u);
  p.tolerance = 0.1;  // the remedy
  EXPECT_TRUE(Bench(p).warnings.empty());
  p.level = Level::reduced;
  p.tolerance = 1e-5;
  EXPECT_TRUE(Bench(p).warnings.empty());
}

TEST(Accuracy, TheMeshGetsFinerRoundThinTcas) {
  // Steady rises for 1 W in TCA 1, by multipole expansions on the circles (an independent code, residual below 1e-10).
  struct Case {
    double ratio, rise;
  };
  for (const auto& [ratio, rise] : {Case{0.05, 109.30383079}, Case{0.01, 142.99734973}}) {
    Parameters p;
    p.tca.outer_radius = filled(ratio * p.body.radius);
    p.tca.inner_radius = filled(0.25 * p.tca.outer_radius[0]);
    p.tolerance = 1e-4;
    Bench bench(p);
    bench.data().V[0][0] = std::sqrt(p.tca.R[0]);
    bench.step(1e9);
    EXPECT_NEAR((bench.data().T[0] - 298.15) / rise, 1.0, 2.0 * p.tolerance) << "ratio " << ratio;
  }
}

/// A wall of a tenth of a TCA's radius, between TCAs or to the rim, changes the solution at order 5 by more than order
/// 4 lets expect. Exact rises for 1 W in TCA 1 by multipole expansions of order 48, residual below 2e-10.
TEST(Accuracy, TheMeshResolvesThinWallsAndThinTcas) {
  struct Case {
    const char* what;
    double outer, inner, offset, rise, neighbour;
  };
  const double thin = 2.1 * 0.85e-3 / std::sqrt(3.0), thinner = 2.02 * 0.85e-3 / std::sqrt(3.0);
  for (const Case& c : {Case{"walls between TCAs", 0.85e-3, 0.2e-3, thin, 82.46692792474, 61.34218659748},
                        Case{"thinner ones", 0.85e-3, 0.2e-3, thinner, 82.48886097021, 62.17824354102},
                        Case{"walls at the rim", 0.85e-3, 0.2e-3, 5e-3 - 1.1 * 0.85e-3, 91.9037705809, 30.0642358741},
                        Case{"thin TCAs", 2.5e-5, 6.25e-6, 2.5e-3, 157.51252396680, 41.86535952120}})
    for (const double tolerance : {1e-2, 1e-3, 1e-4, 1e-5}) {
      Parameters p;
      p.tca.outer_radius = filled(c.outer);
      p.tca.inner_radius = filled(c.inner);
      p.tca.offset = filled(c.offset);
      p.tolerance = tolerance;
      const core::Result<HeatMatrices> m = resolved_matrices(p);
      ASSERT_TRUE(m.status.is_ok());
      const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(m.value.stiffness);
      const Eigen::VectorXd rise = m.value.loads.transpose() * factor.solve(m.value.loads.col(0));
      const double off = std::max(std::abs(rise[0] - c.rise), std::abs(rise[1] - c.neighbour)) / c.rise;
      EXPECT_LE(off, tolerance) << c.what << ", order " << m.value.order;
      EXPECT_LE(off, 1.2 * m.value.error) << c.what << ", order " << m.value.order;
      EXPECT_LE(m.value.error, tolerance);
    }
}

TEST(Accuracy, AnOrderThatDoesNotReachTheToleranceSaysWhatItReaches) {
  Parameters p;
  p.tolerance = 1e-8;
  const core::Result<HeatMatrices> m = resolved_matrices(p);
  EXPECT_EQ(m.value.order, kHighestOrder);
  EXPECT_GT(m.value.error, p.tolerance);
  EXPECT_LT(m.value.error, 1e-7);
}

TEST(TMax, IsTheMaximumOfTheFieldBetweenTheNodes) {
  const int order = 5;
  const LobattoRule rule = lobatto_rule(order);
  const auto n = static_cast<int>(rule.nodes.size());
  ProbePatch element{{}, n, n}, edge{{}, n, 1};
  Eigen::VectorXd inside(n * n), along(n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double s = rule.nodes[i] - 0.1, t = rule.nodes[j] + 0.3;
      element.probes.push_back(i + n * j);
      inside[i + n * j] = 1.0 - s * s - 2.0 * t * t + 0.5 * s * t;
    }
  for (int i = 0; i < n; ++i) {
    edge.probes.push_back(i);
    along[i] = std::cos(rule.nodes[i] - 0.1);
  }
  EXPECT_LT(inside.maxCoeff(), 0.98);
  EXPECT_NEAR(Peak({element}, n * n, order).of(inside), 1.0, 1e-12);
  EXPECT_NEAR(Peak({edge}, n, order).of(along), 1.0, 1e-4);  // of the polynomial through a cosine
  Eigen::VectorXd rising = Eigen::VectorXd::LinSpaced(n, 0.0, 1.0);
  EXPECT_EQ(Peak({edge}, n, order).of(rising), 1.0) << "at the end of the element, not beyond";
}

/// The nodes of the start values' mesh alone are 5 to 14 mK below the field's maximum.
TEST(TMax, DoesNotDependOnWhereTheNodesLie) {
  PerTca most{}, rise{};
  int k = 0;
  for (const double tolerance : {1e-5, 1e-7}) {
    Parameters p;
    p.tolerance = tolerance;
    Bench bench(p);
    bench.data().V[0][0] = 3.0;
    bench.data().V[1][0] = 2.5;
    bench.step(20.0);
    most[k] = bench.data().T_max, rise[k++] = bench.data().T[0];
  }
  EXPECT_NEAR(most[0], most[1], 1.5e-3 + 2.0 * std::abs(rise[0] - rise[1]));
  EXPECT_GT(most[0], rise[0]);
}

/// While it heats and cools, though the field is not calculated in every step.
TEST(TMax, ExceedsALimitWhereItIsAboveIt) {
  for (const Level level : {Level::lumped, Level::reduced, Level::full})
    for (const double limit : {20.0, 40.0, 1e3}) {
      Parameters p;
      p.level = level;
      p.tolerance = 1e-3;
      Trajectory asked = run_of(p), truth = run_of(p);
      int above = 0;
      for (int k = 0; k < 60; ++k) {
        Drive drive;
        drive.V[0][0] = k < 30 ? 3.0 : 0.0;
        for (Trajectory* run : {&asked, &truth}) run->advance(drive, 1.0);
        const bool exceeds = truth.max_rise() > limit;
        EXPECT_EQ(asked.exceeds(limit), exceeds) << "limit " << limit << ", " << k << " s";
        above += exceeds;
      }
      EXPECT_EQ(above > 0, limit < 100.0) << limit;
      EXPECT_LT(above, 60);
    }
}

TEST(BlowUp, IsNamedAtEveryLevel) {
  for (Level level : {Level::lumped, Level::reduced, Level::full}) {
    Parameters p;
    p.level = level;
    p.tolerance = 1e-3;
    p.tca.beta = filled(-1.0);  // R -> 0 as delta -> length
    Bench bench(p);
    bench.data().V[0][0] = 1.0;
    bench.data().delta[0] = {0.0, p.body.length, 0.0, 0.0};  // reached after 1 s
    const fmu::StepResult result = bench.model.step(0.0, 2.0);
    EXPECT_FALSE(result.status.is_ok());
    EXPECT_NE(result.status.text().find("blow-up"), std::string::npos) << result.status.text();
    EXPECT_NE(result.status.text().find("tca.beta"), std::string::npos) << result.status.text();
  }
}

TEST(ModelExchange, RefusesStatesThatNoHeatingReaches) {
  Bench bench(Parameters{});
  std::vector<double> x(most_amplitudes(3), 0.0), dx(most_amplitudes(3), 0.0);
  bench.model.get_states(x);
  EXPECT_TRUE(bench.model.rates(0.0, dx).is_ok());
  for (const double amplitude : {1e9, -1e9}) {
    x[0] = amplitude;
    bench.model.set_states(x);
    const Status status = bench.model.rates(0.0, dx);
    EXPECT_TRUE(status.is_discard());
    EXPECT_NE(status.text().find("shorter steps"), std::string::npos) << status.text();
  }
}

TEST(Work, OfAStepIsBounded) {
  for (Level level : {Level::reduced, Level::full})
    for (const double h : {1e15, 1e30}) {
      Parameters p;
      p.level = level;
      p.tolerance = 1e-2;
      p.tca.alpha_T = filled(1e-3);
      Bench bench(p);
      bench.data().V[0][0] = 1.0;
      const Status status = bench.model.step(0.0, h).status;  // returns: that is the test
      EXPECT_TRUE(status.is_ok() || status.text().find("shorter steps") != std::string::npos) << status.text();
    }
}

}  // namespace
}  // namespace thermal
