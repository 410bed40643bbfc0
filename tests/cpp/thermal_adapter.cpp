// The heat model as fmu::Model: outputs, rates, warnings, refusals.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fmu/thermal_model.hpp"

namespace thermal {
namespace {

/// A built and initialised model with its data at hand.
struct Bench {
  explicit Bench(const Parameters& parameters = {}) {
    data().parameters = parameters;
    fmu::require(model.build());
    fmu::require(model.initialise(0.0));
  }
  Data& data() { return *reinterpret_cast<Data*>(model.data().data()); }
  void step(double h) {
    fmu::require(model.step(t, h).status);
    t += h;
    evaluate();
  }
  void evaluate() {
    fmu::require(model.evaluate(t));
    fmu::require(model.evaluate_on_demand(t, ~0u));
  }
  ThermalModel model;
  double t = 0.0;
};

TEST(ThermalModel, StartsUniformAtT0) {
  for (Level level : {Level::lumped, Level::reduced, Level::full}) {
    Parameters p;
    p.T_0 = 310.0;
    p.level = level;
    Bench bench(p);
    bench.data().V[0][0] = 3.0;
    bench.evaluate();
    const Data& d = bench.data();
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(d.T[i], 310.0);
    EXPECT_EQ(d.T_max, 310.0);
    EXPECT_EQ(d.T_surface, 310.0);
    EXPECT_EQ(d.E_stored, 0.0);
    EXPECT_NEAR(d.P[0], 9.0 / 6.9, 1e-15);
    // h times the surface, 11.85 K above the surroundings
    EXPECT_NEAR(d.Q_loss, 20.0 * 2.0 * M_PI * 5e-3 * 0.04 * 11.85, 1e-9);
    EXPECT_GT(d.T_rate[0], 1.0);
  }
}

TEST(ThermalModel, RatesAreTheDerivativesOfT) {
  for (Level level : {Level::lumped, Level::reduced, Level::full}) {
    Parameters p;
    p.level = level;
    p.tolerance = 1e-7;
    Bench bench(p);
    bench.data().V[1] = {2.0, 0.5, 0.0, 0.0};
    bench.step(1.0);
    bench.data().V[1] = {2.5, 0.5, 0.0, 0.0};
    bench.evaluate();
    const PerTca rate = bench.data().T_rate, before = bench.data().T;
    bench.step(1e-3);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR((bench.data().T[i] - before[i]) / 1e-3, rate[i], 2e-3 * std::abs(rate[i]) + 1e-4);
    }
  }
}

TEST(ThermalModel, WarnsOnceAbove100DegreesCelsius) {
  Bench bench;
  std::vector<std::string> warnings;
  bench.model.warn = [&](std::string_view text) { warnings.emplace_back(text); };
  bench.data().V[0][0] = 3.0;
  while (bench.t < 30.0) bench.step(1.0);
  EXPECT_TRUE(warnings.empty()) << warnings[0];
  while (bench.t < 300.0) bench.step(10.0);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("100 degC"), std::string::npos);
  EXPECT_GT(bench.data().T_max, 373.15);
}

TEST(ThermalModel, NegativeAndHugeVoltagesAreNoErrors) {
  Bench positive, negative, huge;
  positive.data().V[0][0] = 3.0;
  negative.data().V[0][0] = -3.0;
  huge.data().V[0][0] = 1e6;
  for (Bench* bench : {&positive, &negative, &huge}) bench->step(1.0);
  EXPECT_EQ(positive.data().T, negative.data().T);
  EXPECT_TRUE(std::isfinite(huge.data().T[0]));
  EXPECT_NEAR((huge.data().T[0] - 298.15) / (positive.data().T[0] - 298.15), 1e12 / 9.0, 1e4);
}

TEST(ThermalModel, NoNumberBeyondAllBoundsComesOut) {
  for (Level level : {Level::lumped, Level::reduced, Level::full}) {
    Parameters p;
    p.level = level;
    Bench bench(p);
    bench.data().V[0][0] = 1e200;  // its square is beyond all doubles
    EXPECT_TRUE(bench.model.step(0.0, 1.0).status.is_error()) << "level " << static_cast<int>(level);
    EXPECT_TRUE(bench.model.evaluate(0.0).is_discard()) << "level " << static_cast<int>(level);
  }
}

/// Builds with one parameter spoiled; the message must name it and a remedy, and the old model must still work.
void expect_refusal(void (*spoil)(Parameters&), const std::string& name) {
  Bench bench;
  const std::size_t memory = bench.model.memory().size();
  spoil(bench.data().parameters);
  const std::string text = bench.model.build().text();
  EXPECT_NE(text.find(name), std::string::npos) << text;
  EXPECT_NE(text.find("allowed is"), std::string::npos) << text;
  EXPECT_EQ(bench.model.memory().size(), memory);
  bench.data().parameters = {};
  bench.step(1.0);
  EXPECT_EQ(bench.data().T[0], 298.15);
}

TEST(ThermalModel, GeometryThatDoesNotFitIsRefusedByName) {
  expect_refusal([](Parameters& p) { p.body.radius = -1.0; }, "body.radius");
  expect_refusal([](Parameters& p) { p.body.length = 0.0; }, "body.length");
  expect_refusal([](Parameters& p) { p.tca.outer_radius[0] = 6e-3; }, "tca.outer_radius");
  expect_refusal([](Parameters& p) { p.tca.inner_radius[0] = 0.9e-3; }, "tca.inner_radius");
  expect_refusal([](Parameters& p) { p.tca.inner_radius[0] = std::numeric_limits<double>::quiet_NaN(); },
                 "tca.inner_radius");
  expect_refusal([](Parameters& p) { p.tca.offset[0] = 4.5e-3; }, "tca.offset");
  expect_refusal([](Parameters& p) { p.tca.offset[0] = -1e-3; }, "tca.offset");
  expect_refusal([](Parameters& p) { p.tca.offset = filled(0.5e-3); }, "TCA 1 and TCA 2");
  expect_refusal([](Parameters& p) { p.tca.azimuth[1] = 0.1; }, "TCA 1 and TCA 2");
}

TEST(ThermalModel, EveryTcaHasItsOwnResistance) {
  Parameters p;
  p.tca.R = {5.0, 10.0, 20.0};
  Bench bench(p);
  for (auto& V : bench.data().V) V[0] = 2.0;
  bench.evaluate();
  EXPECT_DOUBLE_EQ(bench.data().P[0], 0.8);
  EXPECT_DOUBLE_EQ(bench.data().P[1], 0.4);
  EXPECT_DOUBLE_EQ(bench.data().P[2], 0.2);
}

}  // namespace
}  // namespace thermal
