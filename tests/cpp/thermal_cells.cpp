// TCAs of any radii, anywhere in the section: the cells that they own, and every level of the model in them.
#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <numbers>
#include <random>

#include "thermal_scene.hpp"

namespace thermal {
namespace {

constexpr double kPi = std::numbers::pi;

/// A thick TCA at the axis, thin ones of different radii and materials round it, at different distances.
Parameters uneven_bundle() {
  Parameters p(4);
  p.body.radius = 6e-3;
  p.tca.outer_radius = {1.6e-3, 0.85e-3, 0.5e-3, 1.1e-3};
  p.tca.inner_radius = {0.5e-3, 0.2e-3, 0.1e-3, 0.6e-3};
  p.tca.offset = {0.0, 3.5e-3, 4.9e-3, 3.8e-3};
  p.tca.azimuth = {0.0, 0.3, 2.1, 4.0};
  p.tca.k = {0.19, 0.4, 2.0, 0.1};
  p.tca.rho_c = {0.969e6, 1.2e6, 2e6, 0.6e6};
  p.tca.R = {5.0, 6.0, 7.0, 8.0};
  return p;
}

/// Draws TCAs one after the other where they fit.
Parameters random_bundle(std::mt19937& random, std::size_t count) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Parameters p(count);
  for (std::size_t i = 0; i < count;) {
    p.tca.outer_radius[i] = p.body.radius * uniform(0.03, count < 5 ? 0.4 : 0.18);
    p.tca.inner_radius[i] = p.tca.outer_radius[i] * uniform(0.1, 0.9);
    p.tca.offset[i] = uniform(0.0, 0.999) * (p.body.radius - p.tca.outer_radius[i]);
    p.tca.azimuth[i] = uniform(-7.0, 7.0);
    Tca placed = p.tca;
    placed.count = i + 1;
    if (check(p.body, placed).is_ok()) ++i;
  }
  return p;
}

double heat_capacity(const Parameters& p) {
  double body = p.body.radius * p.body.radius, tcas = 0.0;
  for (std::size_t i = 0; i < p.tca.count; ++i) {
    const double b = p.tca.outer_radius[i], a = p.tca.inner_radius[i];
    body -= b * b;
    tcas += p.tca.rho_c[i] * (b * b - a * a);
  }
  return p.body.length * kPi * (p.body.rho_c * body + tcas);
}

TEST(Cells, CoverEverySectionWithoutFolds) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 60; ++trial) {
    const Parameters p = random_bundle(random, 1 + static_cast<std::size_t>(trial % 12));
    SCOPED_TRACE("trial " + std::to_string(trial));
    const HeatMatrices m = must(heat_matrices(p, 5));
    EXPECT_NEAR(m.mass.sum() / heat_capacity(p), 1.0, 1e-5);
    EXPECT_NEAR(m.surface_conductance / (p.h * 2.0 * kPi * p.body.radius * p.body.length), 1.0, 1e-5);
    EXPECT_GT(m.mass.minCoeff(), 0.0);
    // One piece: conduction leaves the uniform temperature alone, and nothing else.
    const Eigen::VectorXd uniform = Eigen::VectorXd::Ones(m.size());
    EXPECT_LT((m.stiffness * uniform - m.loads.rightCols(1)).norm(), 1e-9 * m.stiffness.norm());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(m.stiffness);
    EXPECT_GT(factor.vectorD().minCoeff(), 0.0);
    const Eigen::VectorXd warmed = factor.solve(m.loads.rightCols(1));
    EXPECT_LT((warmed - uniform).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(Cells, AgreeWithSectorsForARing) {
  for (const std::size_t count : {2, 3, 6}) {
    Parameters ring(count), cells(count);
    ring.tolerance = cells.tolerance = 1e-6;  // of a rise of some 60 K
    for (std::size_t i = 1; i < count; ++i) ring.tca.azimuth[i] += 0.05 * static_cast<double>(i);
    cells.tca = ring.tca;
    cells.tca.offset[0] *= 1.0 + 1e-9;  // no ring to the letter
    Drive drive;
    for (std::size_t i = 0; i < count; ++i) drive.V[i][0] = 1.0 + static_cast<double>(i);
    EXPECT_LT(largest_gap(run_of(ring), run_of(cells), drive, 100.0), 2e-4) << count << " TCAs";
  }
}

TEST(Cells, LevelsAgreeAndKeepTheirBounds) {
  Parameters p = uneven_bundle();
  Drive drive;
  drive.V[0][0] = 3.0;
  drive.V[2] = {0.0, 0.4, 0.0, 0.0};  // TCAs 2 and 4 are passive: they conduct
  const HeatMatrices m = must(resolved_matrices(p));
  EXPECT_LE(m.error, p.tolerance);
  p.level = Level::full;
  p.tolerance = 1e-7;
  Trajectory full(level_of(p, m), 1e-7);
  p.tolerance = 1e-5;
  p.level = Level::reduced;
  Trajectory reduced(level_of(p, m));
  p.level = Level::lumped;
  Trajectory lumped(level_of(p, m));
  for (double t = 0.0; t < 20.0; t += 2.0) {
    for (Trajectory* run : {&full, &reduced, &lumped}) run->advance(later(drive, t), 2.0);
    const Drive now = later(drive, t + 2.0);
    const Observation truth = full.observe(now), seen = reduced.observe(now), rough = lumped.observe(now);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(seen.rise[i], truth.rise[i], seen.bound + 1e-6 * truth.rise[0]) << "TCA " << i << " at " << t;
      EXPECT_NEAR(rough.rise[i], truth.rise[i], rough.bound + 1e-6 * truth.rise[0]) << "TCA " << i << " at " << t;
    }
    EXPECT_NEAR(reduced.max_rise(), full.max_rise(), 1e-3 * full.max_rise());
    EXPECT_NEAR(seen.stored / truth.stored, 1.0, 1e-6);
    EXPECT_GT(truth.rise[1], 0.0);
    EXPECT_EQ(truth.power[1], 0.0);
  }
}

TEST(Cells, HigherOrdersChangeNothing) {
  const Parameters p = uneven_bundle();
  Drive drive;
  for (std::size_t i = 0; i < 4; ++i) drive.V[i][0] = 2.0;
  Trajectory run = run_of(p, 9);
  run.advance(drive, 1e4);
  EXPECT_LT(largest_gap(run_of(p), run_of(p, 9), drive, 100.0), 2e-5 * run.observe(drive).rise[2]);
}

TEST(Cells, AChangeOfNumbersChangesNothingElse) {
  const Parameters p = uneven_bundle();
  Parameters q = p;
  const std::array<std::size_t, 4> old{2, 0, 3, 1};
  for (PerTca Tca::*values :
       {&Tca::outer_radius, &Tca::inner_radius, &Tca::offset, &Tca::azimuth, &Tca::k, &Tca::rho_c, &Tca::R})
    for (std::size_t i = 0; i < 4; ++i) (q.tca.*values)[i] = (p.tca.*values)[old[i]];
  Drive drive, renamed;
  for (std::size_t i = 0; i < 4; ++i) drive.V[i][0] = 1.0 + static_cast<double>(i);
  for (std::size_t i = 0; i < 4; ++i) renamed.V[i] = drive.V[old[i]];
  Trajectory a = run_of(p, 6), b = run_of(q, 6);
  a.advance(drive, 7.0);
  b.advance(renamed, 7.0);
  const Observation one = a.observe(drive), other = b.observe(renamed);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(other.rise[i], one.rise[old[i]], 2e-4) << "TCA " << i;
  EXPECT_NEAR(other.loss, one.loss, 1e-6);
  EXPECT_NEAR(other.stored, one.stored, 1e-5 * one.stored);
}

TEST(Cells, HeatIsBalanced) {
  for (const Level level : {Level::lumped, Level::reduced, Level::full}) {
    Parameters p = uneven_bundle();
    p.level = level;
    Trajectory run = run_of(p, 5);
    Drive drive;
    for (std::size_t i = 0; i < 4; ++i) drive.V[i][0] = 2.0;
    // Gauss-Legendre of the loss over short steps, against what is stored.
    constexpr double kStep = 0.05, kAt = 0.5 - 0.28867513459481287;
    run.advance(drive, 20.0);
    Observation seen = run.observe(drive);
    const double start = seen.stored;
    double lost = 0.0, power = 0.0;
    for (std::size_t i = 0; i < 4; ++i) power += seen.power[i];
    for (int n = 0; n < 40; ++n) {
      for (const double part : {kAt, 1.0 - 2.0 * kAt}) {
        run.advance(drive, part * kStep);
        lost += 0.5 * kStep * run.observe(drive).loss;
      }
      run.advance(drive, kAt * kStep);
    }
    EXPECT_NEAR(run.observe(drive).stored - start, power * 2.0 - lost, 2e-6 * power) << static_cast<int>(level);
  }
}

TEST(Cells, ARingRoundTheAxisStaysSymmetric) {
  Parameters p(7);
  p.tca.outer_radius = filled(0.8e-3);
  p.tca.offset[0] = 0.0;
  for (std::size_t i = 1; i < 7; ++i) p.tca.offset[i] = 3e-3, p.tca.azimuth[i] = kPi / 3.0 * static_cast<double>(i);
  Trajectory run = run_of(p, 5);
  Drive drive;
  drive.V[0][0] = 3.0;
  run.advance(drive, 30.0);
  const Observation seen = run.observe(drive);
  for (std::size_t i = 2; i < 7; ++i) EXPECT_NEAR(seen.rise[i] / seen.rise[1], 1.0, 1e-5);
  EXPECT_GT(seen.rise[0], 3.0 * seen.rise[1]);
  EXPECT_GT(seen.rise[1], 1.0);
}

TEST(Cells, EachTcaHasAResistanceOfItsOwn) {
  Parameters p = uneven_bundle();
  p.tca.alpha_T = {0.004, 0.0, 0.0, -0.002};
  p.tca.beta = {0.0, 0.5, 0.0, 0.0};
  Trajectory run = run_of(p, 4);
  Drive drive;
  for (std::size_t i = 0; i < 4; ++i) drive.V[i][0] = 2.0, drive.delta[i][0] = 2e-3;
  run.advance(drive, 5.0);
  const Observation seen = run.observe(drive);
  for (std::size_t i = 0; i < 4; ++i) {
    const double R = p.tca.R[i] * (1.0 + p.tca.alpha_T[i] * (p.T_0 + seen.rise[i] - p.tca.T_ref) +
                                   p.tca.beta[i] * 2e-3 / p.body.length);
    EXPECT_NEAR(seen.power[i], 4.0 / R, 1e-12) << "TCA " << i;
  }
}

TEST(Cells, RefuseTcasThatDoNotFit) {
  const auto refusal = [](auto&& spoil) {
    Parameters p = uneven_bundle();
    spoil(p.tca);
    return check(p.body, p.tca).text();
  };
  const auto names = [](const std::string& text, const char* word) { return text.find(word) != std::string::npos; };
  EXPECT_EQ(refusal([](Tca&) {}), "");
  EXPECT_TRUE(names(refusal([](Tca& t) { t.outer_radius[2] = 1.5e-3; }), "tca.offset[3]"));
  EXPECT_TRUE(names(refusal([](Tca& t) { t.outer_radius[2] = 7e-3; }), "tca.outer_radius[3]"));
  EXPECT_TRUE(names(refusal([](Tca& t) { t.inner_radius[3] = 1.2e-3; }), "tca.inner_radius[4]"));
  EXPECT_TRUE(names(refusal([](Tca& t) { t.offset[1] = 2.4e-3; }), "TCA 1 and TCA 2"));  // no neighbours by azimuth
}

}  // namespace
}  // namespace thermal
