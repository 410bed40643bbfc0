// Stability of equilibria, admissible strains, and the estimate of the spatial error.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

#include "probe/host.hpp"
#include "rod_support.hpp"

using namespace rod;
using rod_test::bare_rod;
using rod_test::Bench;

namespace {

bool tangent_is_positive(Bench& bench) {
  Vector r;
  Workspace work;
  Matrix K;
  bench.rod.static_residual(bench.state.q.data(), loads_at(bench.inputs, 0.0), work, r);
  bench.rod.tangent(work, {.q = 1.0}, K);
  const Eigen::MatrixXd symmetric = 0.5 * (K + K.transpose());
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(symmetric).eigenvalues()[0] > 0.0;
}

void set_force(Bench& bench, double x, double y, double z) {
  bench.inputs.tip_force[0][0] = x, bench.inputs.tip_force[1][0] = y, bench.inputs.tip_force[2][0] = z;
}

/// Distance [m] of the tip from where damped motion from the unloaded shape comes to rest.
double distance_to_damped_motion(const Parameters& p, const Bench& statics) {
  Parameters damped = p;
  damped.set(&Segment::retardation, 0.05);
  Bench motion(damped);
  motion.inputs = statics.inputs;
  EXPECT_TRUE(step_rosenbrock(motion.rod, motion.inputs, 60.0, 1e-5, motion.state, motion.scratch).status.is_ok());
  Bench copy(p);
  copy.inputs = statics.inputs;
  copy.state.q = statics.state.q;
  const Triple a = copy.outputs().tip_p, b = motion.outputs().tip_p;
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

}  // namespace

TEST(RodStability, EquilibriaBeyondBucklingAreTheStableOnes) {
  Parameters p;
  p.set(&Segment::order, 7);
  const struct {
    double force[3], x, tolerance;
  } cases[] = {{{0.1, 0.0, -0.1}, 36.5e-3, 0.1e-3}, {{0.02, 0.0, -0.1}, 34.9e-3, 0.1e-3}};
  for (const auto& each : cases) {
    Bench bench(p);
    set_force(bench, each.force[0], each.force[1], each.force[2]);
    ASSERT_TRUE(bench.solve_equilibrium());
    EXPECT_TRUE(tangent_is_positive(bench));
    EXPECT_NEAR(bench.outputs().tip_p[0], each.x, each.tolerance);
  }
}

TEST(RodStability, ColdRodBucklesAtItsKnownLoad) {
  for (const auto& [gravity, load] : {std::pair{0.0, 53.4e-3}, std::pair{-9.81, 41.7e-3}})
    for (double share : {0.995, 1.005}) {
      Parameters p;
      p.set(&Segment::order, 7);
      Bench bench(p);
      bench.inputs.gravity[2][0] = gravity;
      set_force(bench, 0.0, 0.0, -share * load);
      ASSERT_TRUE(bench.solve_equilibrium());
      const Triple tip = bench.outputs().tip_p;
      EXPECT_EQ(std::hypot(tip[0], tip[1]) > 1e-4, share > 1.0) << "gravity " << gravity << ", share " << share;
      EXPECT_EQ(bench.scratch.stability.doubt() == Stability::Doubt::ambiguous, share > 1.0);
      EXPECT_TRUE(tangent_is_positive(bench));
    }
}

TEST(RodStability, RandomLoadsEndWhereDampedMotionEnds) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int draw = 0; draw < 60; ++draw) {
    Parameters p;
    p.set(&Segment::order, 2 + draw % 6);
    double x = normal(random), y = normal(random), z = normal(random);
    const double scale = 5e-3 * (1 + draw) / std::hypot(x, y, z);  // up to 300 mN
    Bench bench(p);
    set_force(bench, scale * x, scale * y, scale * z);
    if (!bench.solve_equilibrium()) continue;  // compressed beyond what is admissible
    EXPECT_TRUE(tangent_is_positive(bench)) << "draw " << draw;
    if (draw % 6 == 0) {
      EXPECT_LT(distance_to_damped_motion(p, bench), 1e-6) << "draw " << draw;
    }
  }
}

TEST(RodStability, StraightRodBeyondEulersLoadFallsTheWayOfTheSmallestSideLoad) {
  Parameters p = bare_rod();
  const double euler = std::pow(0.5 * M_PI / p.length(), 2) * Section::of(p).stiffness[0];
  for (int order : {2, 3, 4, 5, 6, 7})
    for (double share : {0.9, 1.5, 2.0, 3.0, 5.0})
      for (double side : {1e-6, -1e-6}) {
        p.set(&Segment::order, order);
        Bench bench(p);
        set_force(bench, side * euler, 0.0, -share * euler);
        ASSERT_TRUE(bench.solve_equilibrium()) << "order " << order << ", share " << share << ", side " << side;
        EXPECT_EQ(bench.scratch.stability.doubt(), Stability::Doubt::none);
        EXPECT_TRUE(tangent_is_positive(bench));
        EXPECT_GT(bench.outputs().tip_p[0] * side, 0.0);
        EXPECT_EQ(std::abs(bench.outputs().tip_p[0]) > 0.5 * p.length(), share > 1.0);
        EXPECT_LT(distance_to_damped_motion(p, bench), 1e-9) << "order " << order << ", share " << share;
      }
}

TEST(RodStability, SideLoadsTooSmallForMotionStillChooseTheSide) {
  Parameters p = bare_rod();
  const double euler = std::pow(0.5 * M_PI / p.length(), 2) * Section::of(p).stiffness[0];
  for (double share : {1.01, 2.0, 12.0})
    for (double size : {1e-9, 1e-11})
      for (double angle : {0.0, 1.0, 2.5, 4.0}) {
        Bench bench(p);
        set_force(bench, size * euler * std::cos(angle), size * euler * std::sin(angle), -share * euler);
        ASSERT_TRUE(bench.solve_equilibrium());
        EXPECT_EQ(bench.scratch.stability.doubt(), Stability::Doubt::none);
        const Triple tip = bench.outputs().tip_p;
        EXPECT_NEAR(std::remainder(std::atan2(tip[1], tip[0]) - angle, 2.0 * M_PI), 0.0, 1e-4) << size;
      }
}

TEST(RodStability, BuckledRodIsTheElasticaOfEllipticIntegrals) {
  Parameters p = bare_rod();
  p.set(&Segment::strains, Strains::bending);  // neither shears nor stretches
  p.set(&Segment::order, 7);
  const double L = p.length(), euler = std::pow(0.5 * M_PI / L, 2) * Section::of(p).stiffness[0];
  for (double share : {1.5, 2.0, 3.0, 5.0}) {
    double low = 0.0, high = 1.0;  // modulus k = sin(half of the tip's angle): share = (2 K(k)/pi)^2
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (std::comp_ellint_1(middle) < 0.5 * M_PI * std::sqrt(share) ? low : high) = middle;
    }
    const double K = std::comp_ellint_1(low), E = std::comp_ellint_2(low);
    Bench bench(p);
    set_force(bench, 1e-6 * euler, 0.0, -share * euler);
    ASSERT_TRUE(bench.solve_equilibrium());
    EXPECT_NEAR(bench.outputs().tip_p[0], 2.0 * low / K * L, 1e-4 * L) << share;
    EXPECT_NEAR(bench.outputs().tip_p[2], (2.0 * E / K - 1.0) * L, 1e-4 * L) << share;
  }
}

TEST(RodStability, LargeAndSmallStepsOfLoadEndAtTheSameShape) {
  const auto tip = [](int steps) {
    Parameters p;
    Bench bench(p);
    for (int i = 1; i <= steps; ++i) {
      set_force(bench, 2e-3, 0.0, -0.12 * i / steps);
      EXPECT_TRUE(bench.solve_equilibrium());
    }
    return bench.outputs().tip_p[0];
  };
  EXPECT_NEAR(tip(1), tip(40), 1e-8);
}

TEST(RodAdmissibility, CompressionBeyondTheAxialStiffnessIsRefused) {
  Parameters p = bare_rod();
  p.set(&Segment::strains, Strains::extensible);
  const double EA = Section::of(p).stiffness[5];
  for (double share : {0.5, 1.5}) {
    Bench bench(p);
    set_force(bench, 0.0, 0.0, -share * EA);
    const core::Status status = solve_equilibrium(bench.rod, loads_at(bench.inputs, 0.0), bench.state, bench.scratch);
    if (share > 1.0) {
      EXPECT_TRUE(status.is_discard());
    }
    EXPECT_TRUE(bench.rod.is_admissible(bench.state.q.data()));
  }
}

TEST(RodAdmissibility, UnloadedArcsAreExactOrRefused) {
  for (double curvature : {500.0, 1000.0, 2400.0, 5000.0})
    for (int order : {2, 4, 7}) {
      probe::Host host;
      host.set("body.curvature[1]", curvature);
      host.set_integer("order", order);
      host.set_integer("tca.law", 2), host.set("tca.stiffness", 0.0);
      fmi2EnterInitializationMode(host.fmu);
      const bool accepted = fmi2ExitInitializationMode(host.fmu) == fmi2OK;
      EXPECT_EQ(accepted, curvature * 0.04 <= max_resolved_curvature()) << curvature;
      if (accepted) {
        EXPECT_NEAR(host.get("tip.p[3]"), std::sin(curvature * 0.04) / curvature, 1e-7 * 0.04) << curvature;
      }
    }
}

TEST(RodAdmissibility, ViolentHeatEndsByNameOrKeepsItsEnergy) {
  for (double T : {380.0, 500.0, 600.0}) {
    Parameters p;
    Bench bench(p);
    bench.inputs.T[0][0] = T;
    const auto total = [&bench] {
      const Outputs y = bench.outputs();
      return y.energy_elastic + y.energy_tca + y.energy_kinetic;
    };
    const double before = total();
    const StepOutcome outcome = step_rosenbrock(bench.rod, bench.inputs, 0.5, 1e-6, bench.state, bench.scratch);
    EXPECT_NEAR(total(), before, 2e-3 * before) << T;
    EXPECT_EQ(outcome.status.is_ok(), T < 400.0);
    if (!outcome.status.is_ok()) {
      const std::string text = outcome.status.text();
      EXPECT_TRUE(text.find("stretch") != text.npos || text.find("curvature") != text.npos) << text;
    }
  }
}

TEST(RodSpatialError, EstimatesTheErrorOfStatics) {
  for (double helix : {0.0, 60.0, 120.0, 200.0})
    for (int order : {2, 3, 4, 5}) {
      Parameters p;
      p.set(&Tca::helix, helix);
      if (helix * p.length() > std::max(6.3, 1.5 * (order + 1))) continue;
      const auto solve = [&](int degree) {
        p.set(&Segment::order, degree);
        Bench bench(p);
        bench.inputs.T[0][0] = 325.0, bench.inputs.gravity[0][0] = 9.81;
        set_force(bench, 0.0, 5e-3, 0.0);
        EXPECT_TRUE(bench.solve_equilibrium());
        return std::pair(bench.outputs(), bench.rod.spatial_error(bench.state.q.data(), loads_at(bench.inputs, 0.0),
                                                                  bench.scratch.newton.work));
      };
      const auto [coarse, estimate] = solve(order);
      const auto [fine, rest] = solve(7);
      double error = 0.0;
      for (std::size_t m = 0; m < kShapeStations; ++m)
        for (int c = 0; c < 3; ++c) error = std::max(error, std::abs(coarse.shape[m][c] - fine.shape[m][c]));
      for (std::size_t i = 0; i < kTcas; ++i) error = std::max(error, std::abs(coarse.delta[i] - fine.delta[i]));
      EXPECT_GT(estimate, 0.3 * error) << "helix " << helix << ", order " << order << ", error " << error;
      EXPECT_LT(estimate, 10.0 * error + 2.0 * rest) << "helix " << helix << ", order " << order;
    }
}

TEST(RodFmu, NeverAnswersWithNumbersThatAreNotFinite) {
  const auto answer = [](auto set) {
    probe::Host host;
    host.set_integer("closure", 2);
    set(host);
    fmi2EnterInitializationMode(host.fmu);
    fmi2ExitInitializationMode(host.fmu);
    double value[2] = {0.0, 0.0};
    const fmi2ValueReference vr[2] = {probe::reference("N[1]"), probe::reference("energy.tca")};
    const fmi2Status status = fmi2GetReal(host.fmu, vr, 2, value);
    return status >= fmi2Discard || (std::isfinite(value[0]) && std::isfinite(value[1]));
  };
  EXPECT_TRUE(answer([](auto& host) { host.set_integer("tca.pitch", 2), host.set("delta_guess[1]", 0.1); }));
  EXPECT_TRUE(answer([](auto& host) { host.set("tca.rho_T", -0.01), host.set("T[1]", 398.15); }));
  EXPECT_TRUE(answer([](auto& host) { host.set("delta_guess[1]", 1e200); }));
}

TEST(RodFmu, StepsOfAnyLengthReturn) {
  for (int method : {1, 2, 3, 4, 5, 6})
    for (double h : {5e-324, 1e30}) {
      probe::Host host;
      host.set_integer("method", method), host.set_integer("order", method == 5 ? 4 : 0);
      host.set("T[1]", 310.0);
      host.start();
      EXPECT_LE(fmi2DoStep(host.fmu, 0.0, h, fmi2True), fmi2Error) << "method " << method << ", h " << h;
    }
}
