// The network behind `lumped` for random geometries, materials and surroundings: whatever is not refused is a network
// of positive resistors and capacitors, with all the heat, stable, and as far from the mesh as it says.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "thermal_scene.hpp"

namespace thermal {
namespace {

/// Draws parameters from their whole ranges; where a range has no end, within a factor 1000 of the start value.
Parameters random_parameters(std::mt19937& random, std::size_t count) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto contrast = [&](double value, double factor) { return value * std::pow(factor, uniform(-1.0, 1.0)); };
  Parameters p(count);
  p.level = Level::lumped;
  p.body.radius = contrast(5e-3, 10.0);
  const double outer = p.body.radius * uniform(0.02, count == 1 ? 0.9 : 0.45);
  p.tca.outer_radius = filled(outer);
  p.tca.inner_radius = filled(outer * uniform(0.02, 0.95));
  p.tca.offset = filled(uniform(0.0, p.body.radius - outer));
  const double turn = uniform(-10.0, 10.0), unevenness = uniform(0.0, 1.0);
  for (std::size_t i = 0; i < count; ++i) {
    p.tca.azimuth[(5 * i) % count] = turn + 2.0 * std::numbers::pi / static_cast<double>(count) *
                                                (static_cast<double>(i) + unevenness * uniform(-0.5, 0.5));
  }
  p.tca.k = filled(contrast(0.19, 1e3));
  p.tca.rho_c = filled(contrast(0.969e6, 1e3));
  p.h = std::pow(10.0, uniform(-3.0, 4.0));
  return p;
}

class RandomNetwork : public testing::TestWithParam<std::size_t> {};

TEST_P(RandomNetwork, IsPositiveForEveryGeometryAndMaterial) {
  std::mt19937 random(7);
  const int channels = static_cast<int>(GetParam()) + 1;
  const int wanted = GetParam() > 3 ? 10 : 40;
  int built = 0;
  for (int trial = 0; built < wanted && trial < 10000; ++trial) {
    const Parameters p = random_parameters(random, GetParam());
    const core::Result<HeatMatrices> meshed = heat_matrices(p, 3);
    if (!meshed.status.is_ok()) continue;  // the TCAs do not fit
    const HeatMatrices& m = meshed.value;
    ++built;
    SCOPED_TRACE("trial " + std::to_string(trial));
    const Network net = network(m);
    EXPECT_GT(net.capacity.minCoeff(), 0.0) << net.capacity.transpose();
    EXPECT_NEAR(net.capacity.sum(), m.mass.sum(), 1e-9 * m.mass.sum());
    const double largest = net.conductance.cwiseAbs().maxCoeff();
    for (int i = 0; i < channels; ++i) {
      for (int j = 0; j < i; ++j) {
        EXPECT_LE(net.conductance(i, j), 0.0) << i << ", " << j << "\n" << net.conductance;
        EXPECT_EQ(net.conductance(i, j), net.conductance(j, i));
      }
      const double outward = net.conductance.row(i).sum();
      EXPECT_NEAR(outward, i + 1 == channels ? m.surface_conductance : 0.0, 1e-12 * largest);
    }
    const ModalModel fine = reduced(m, 1e-3), model = lumped(m, fine);
    EXPECT_GT(model.rate.minCoeff(), 0.0);
    const auto steady = [](const ModalModel& of, int i) {
      return of.load.col(i).cwiseAbs2().cwiseQuotient(of.rate).sum();
    };
    for (int i = 0; i + 1 < channels; ++i) {
      EXPECT_LE(std::abs(steady(model, i) - steady(fine, i)), model.step_bound(i, i));
      EXPECT_NEAR(steady(model, i) / steady(fine, i), 1.0, 0.1) << "TCA " << i;
    }
  }
  EXPECT_EQ(built, wanted);
}

INSTANTIATE_TEST_SUITE_P(Thermal, RandomNetwork, testing::Values(1, 2, 3, 6));

}  // namespace
}  // namespace thermal
