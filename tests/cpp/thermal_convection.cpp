// Heat transfer that follows the surface: correlations against worked examples, levels, balance, steady states.
#include <gtest/gtest.h>

#include <numbers>

#include "fmu/thermal_model.hpp"
#include "physics/convection.hpp"
#include "thermal_scene.hpp"

namespace thermal {
namespace {

Parameters with(ConvectionKind kind, Level level, std::size_t tcas = 3) {
  Parameters p(tcas);
  p.convection = kind;
  p.level = level;
  return p;
}

// Incropera and DeWitt, Fundamentals of Heat and Mass Transfer: example 9.4, a horizontal pipe of 0.1 m at 165 degC in
// air of 23 degC (Nu = 23.3, k = 0.0313); example 7.4, a cylinder of 12.7 mm at 128.4 degC in air of 26.2 degC at 10
// m/s (Nu = 40.6).
TEST(Convection, CorrelationsGiveTheWorkedExamples) {
  Parameters pipe = with(ConvectionKind::free, Level::full);
  pipe.body.radius = 0.05;
  EXPECT_NEAR(Convection(pipe).coefficient(438.15, 296.15, 0.0), 23.3 * 0.0313 / 0.1, 0.02 * 7.29);
  Parameters cylinder = with(ConvectionKind::forced, Level::full);
  cylinder.body.radius = 0.5 * 12.7e-3;
  EXPECT_NEAR(Convection(cylinder).coefficient(401.55, 299.35, 10.0), 40.6 * 0.030 / 12.7e-3, 0.03 * 96.0);
}

TEST(Convection, AirHasItsTabulatedProperties) {
  // Incropera and DeWitt, table A.4: T, nu, k, Pr.
  const double table[3][4] = {
      {250.0, 11.44e-6, 22.3e-3, 0.720}, {300.0, 15.89e-6, 26.3e-3, 0.707}, {400.0, 26.41e-6, 33.8e-3, 0.690}};
  for (const auto& [T, nu, k, prandtl] : table) {
    const Air air(T);
    EXPECT_NEAR(air.kinematic_viscosity / nu, 1.0, 0.02) << T;
    EXPECT_NEAR(air.conductivity / k, 1.0, 0.015) << T;
    EXPECT_NEAR(air.prandtl / prandtl, 1.0, 0.03) << T;
  }
}

TEST(Convection, FreeAndForcedMeet) {
  const Convection free(with(ConvectionKind::free, Level::full)), forced(with(ConvectionKind::forced, Level::full));
  EXPECT_NEAR(forced.coefficient(330.0, 300.0, 0.0) / free.coefficient(330.0, 300.0, 0.0), 1.0, 1e-3);
  EXPECT_GT(forced.coefficient(330.0, 300.0, 2.0), 3.0 * free.coefficient(330.0, 300.0, 0.0));
  EXPECT_GT(free.coefficient(350.0, 300.0, 0.0), 1.2 * free.coefficient(305.0, 300.0, 0.0));
  EXPECT_EQ(Convection(Parameters()).coefficient(350.0, 300.0, 5.0), 20.0);
}

class Varying : public testing::TestWithParam<std::tuple<ConvectionKind, Level, std::size_t>> {
 protected:
  const std::size_t count = std::get<2>(GetParam());
  const Parameters p = with(std::get<0>(GetParam()), std::get<1>(GetParam()), count);
  Drive drive() const {
    Drive drive;
    drive.V[0][0] = 3.0;
    drive.ambient_rise = {-5.0, 0.1, 0.0, 0.0};
    drive.air_speed = {0.5, 0.05, 0.0, 0.0};
    return drive;
  }
};

TEST_P(Varying, HeatIsBalanced) {
  Trajectory run = run_of(p, 5);
  constexpr double kStep = 0.1, kAt = 0.5 - 0.28867513459481287;
  double t = 5.0, lost = 0.0;
  run.advance(drive(), t);
  const double start = run.observe(later(drive(), t)).stored;
  for (int n = 0; n < 20; ++n) {
    for (const double part : {kAt, 1.0 - 2.0 * kAt}) {
      run.advance(later(drive(), t), part * kStep);
      t += part * kStep;
      lost += 0.5 * kStep * run.observe(later(drive(), t)).loss;
    }
    run.advance(later(drive(), t), kAt * kStep);
    t += kAt * kStep;
  }
  const double power = run.observe(later(drive(), t)).power[0];
  EXPECT_NEAR(run.observe(later(drive(), t)).stored - start, power * 2.0 - lost, 1e-5 * power);
}

TEST_P(Varying, ShorterStepsChangeNothing) {
  Trajectory one = run_of(p, 4), many = run_of(p, 4);
  one.advance(drive(), 8.0);
  for (int n = 0; n < 16; ++n) many.advance(later(drive(), 0.5 * n), 0.5);
  const Observation a = one.observe(later(drive(), 8.0)), b = many.observe(later(drive(), 8.0));
  for (std::size_t i = 0; i < count; ++i) EXPECT_NEAR(a.rise[i], b.rise[i], 5e-5 * a.rise[0]);
}

TEST_P(Varying, SteadyStateIsThatOfItsOwnCoefficient) {
  Trajectory run = run_of(p, 4);
  Drive held;
  held.V[0][0] = 2.0;
  held.air_speed[0] = 1.0;
  run.advance(held, 2e4);
  const Observation seen = run.observe(held);
  const double area = 2.0 * std::numbers::pi * p.body.radius * p.body.length;
  EXPECT_NEAR(seen.loss, seen.power[0], 1e-5 * seen.power[0]);
  EXPECT_NEAR(seen.loss, seen.coefficient * area * seen.surface_rise, 1e-6 * seen.loss);
  Parameters q = p;
  q.convection = ConvectionKind::constant;
  q.h = seen.coefficient;
  Trajectory constant = run_of(q, 4);
  constant.advance(held, 2e4);
  const PerTca expected = constant.observe(held).rise;
  for (std::size_t i = 0; i < count; ++i)
    EXPECT_NEAR(seen.rise[i], expected[i], (p.level == Level::full ? 1e-4 : 0.05) * expected[i]);
}

INSTANTIATE_TEST_SUITE_P(Convection, Varying,
                         testing::Combine(testing::Values(ConvectionKind::free, ConvectionKind::forced),
                                          testing::Values(Level::lumped, Level::full), testing::Values(2, 3)));

TEST(Convection, LevelsAgree) {
  Trajectory full = run_of(with(ConvectionKind::free, Level::full), 5),
             lumped = run_of(with(ConvectionKind::free, Level::lumped), 5);
  Drive drive;
  drive.V[0][0] = 2.0;
  for (Trajectory* run : {&full, &lumped}) run->advance(drive, 60.0);
  const Observation truth = full.observe(drive), rough = lumped.observe(drive);
  EXPECT_NEAR(rough.surface_rise / truth.surface_rise, 1.0, 0.05);
  EXPECT_NEAR(rough.rise[0] / truth.rise[0], 1.0, 0.08);
}

TEST(Convection, ReducedRefusesWhatIsNotLinear) {
  ThermalModel model;
  Data& data = *reinterpret_cast<Data*>(model.data().data());
  data.parameters.convection = ConvectionKind::free;
  const std::string text = model.build().text();
  EXPECT_NE(text.find("choose level = full or lumped"), std::string::npos) << text;
  data.parameters.level = Level::lumped;
  EXPECT_TRUE(model.build().is_ok());
}

TEST(Convection, ModelExchangeHasTheRatesOfTheSteps) {
  const Parameters p = with(ConvectionKind::forced, Level::lumped);
  const auto level = level_of(p, must(heat_matrices(p, 4)));
  std::vector<double> state(level->state_size(), 0.0), x(level->amplitudes()), dx(x.size()), after(x.size());
  Drive drive;
  drive.V[0][0] = 3.0;
  drive.air_speed[0] = 2.0;
  must(level->advance(state, drive, 10.0, 1e-8));
  level->get_amplitudes(state, x);
  must(level->rates(state, drive, dx));
  constexpr double kStep = 1e-3;
  must(level->advance(state, drive, kStep, 1e-8));
  level->get_amplitudes(state, after);
  for (std::size_t k = 0; k < x.size(); ++k)
    EXPECT_NEAR((after[k] - x[k]) / kStep, dx[k], 2e-3 * (0.01 + std::abs(dx[k])));
}

}  // namespace
}  // namespace thermal
