// Accuracy of the levels: mesh, reduction against its bound, network, symmetry.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "thermal_scene.hpp"

namespace thermal {
namespace {

Trajectory reduced_run(int order, double tolerance) {
  Parameters p;
  p.tolerance = tolerance;
  return run_of(p, order);
}

TEST(Scene, StepAgreesWithTheIndependentSolutionAtEveryRow) {
  ASSERT_EQ(step_reference().size(), 8u);
  for (Level level : {Level::full, Level::reduced}) {
    Parameters p;
    p.level = level;
    EXPECT_LE(against_reference(run_of(p)), 2e-3) << "level " << static_cast<int>(level);
  }
}

TEST(Mesh, ConvergesSpectrally) {
  // Space alone: reduced to 1e-8, exact in time. The reference's own error, 1e-4 K, hides the rest from order 6 on.
  EXPECT_LE(must(heat_matrices({}, 5)).size(), 1500);
  EXPECT_LE(against_reference(reduced_run(5, 1e-8)), 3e-4);
  const auto error = [](int order) {
    Trajectory run = reduced_run(order, 1e-8), truth = reduced_run(8, 1e-8);
    const Drive drive = step_scene();
    double worst = 0.0;
    for (int i = 0; i < 30; ++i) {
      run.advance(drive, 1.0);
      truth.advance(drive, 1.0);
      for (std::size_t k = 0; k < 3; ++k) {
        worst = std::max(worst, std::abs(run.observe(drive).rise[k] - truth.observe(drive).rise[k]));
      }
    }
    return worst;
  };
  EXPECT_LE(must(heat_matrices({}, 6)).size(), 2500);
  double before = error(2);
  for (int order : {3, 4, 5, 6}) {
    const double here = error(order);
    EXPECT_LT(here, 0.2 * before) << "order " << order;
    before = here;
  }
  EXPECT_LE(before, 2e-5);
}

TEST(Reduction, ErrorStaysBelowItsBoundAndNearIt) {
  // Heat of one TCA, of all, and from the surroundings, on one mesh.
  Drive one, surroundings;
  one.V[1][0] = 3.0;
  surroundings.ambient_rise[0] = 40.0;
  for (double tolerance : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
    double largest_ratio = 0.0;
    for (const Drive& drive : {one, step_scene(), surroundings}) {
      Trajectory run = reduced_run(4, tolerance);
      const double error = largest_gap(reduced_run(4, tolerance), reduced_run(4, 1e-8), drive, 300.0);
      run.advance(drive, 300.0);
      const double bound = run.observe(drive).bound;
      EXPECT_LT(error, bound) << "tolerance " << tolerance;
      largest_ratio = std::max(largest_ratio, error / bound);
    }
    EXPECT_GT(largest_ratio, 1.0 / 30.0) << "tolerance " << tolerance;
  }
  EXPECT_LE(reduced_run(4, 1e-5).unknowns(), 30);
}

TEST(Reduction, BoundHoldsAgainstAllModesOfTheMesh) {
  // The unreduced step response from a dense eigendecomposition, without Krylov spaces or truncation.
  Parameters p;
  const HeatMatrices m = must(heat_matrices(p, 3));
  const Eigen::VectorXd root = m.mass.cwiseSqrt();
  const Eigen::MatrixXd a =
      root.cwiseInverse().asDiagonal() * Eigen::MatrixXd(m.stiffness) * root.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(a);
  const Eigen::MatrixXd load = eigen.eigenvectors().transpose() * root.cwiseInverse().asDiagonal() * m.loads;
  const auto response = [](const auto& rate, const auto& b, int i, int j, double t) {
    return (b.col(i).array() * b.col(j).array() * -(-rate.array() * t).expm1() / rate.array()).sum();
  };
  for (double tolerance : {1e-2, 1e-4, 1e-6}) {
    const ModalModel model = reduced(m, tolerance);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 4; ++j) {
        double worst = 0.0;
        for (double t = 1e-5; t < 1e4; t *= 1.1) {
          worst = std::max(worst, std::abs(response(eigen.eigenvalues(), load, i, j, t) -
                                           response(model.rate, model.load, i, j, t)));
        }
        if (i == j) {
          EXPECT_LE(model.step_bound(i, i), tolerance * response(model.rate, model.load, i, i, 1e6));
        }
        EXPECT_LT(worst, model.step_bound(i, j)) << tolerance << ": T[" << i << "] from channel " << j;
      }
  }
}

TEST(Reduction, SteadyStatesAreExact) {
  const HeatMatrices m = must(heat_matrices({}, 4));
  const ModalModel coarse = reduced(m, 1e-1), fine = reduced(m, 1e-8), network = lumped(m, coarse);
  const auto steady = [](const ModalModel& model) {
    return Eigen::MatrixXd(model.load.transpose() * model.rate.cwiseInverse().asDiagonal() * model.load);
  };
  EXPECT_LT((steady(coarse) - steady(fine)).norm(), 1e-10 * steady(fine).norm());
  EXPECT_LT((steady(network) - steady(fine)).norm(), 1e-10 * steady(fine).norm());
}

TEST(Lumped, IsASymmetricPositiveNetworkWithAllTheHeat) {
  const HeatMatrices m = must(heat_matrices({}, 4));
  const Network net = network(m);
  EXPECT_NEAR(net.capacity.sum(), m.mass.sum(), 1e-12 * m.mass.sum());
  EXPECT_GT(net.capacity.minCoeff(), 0.0);
  for (int i = 0; i < 4; ++i) {
    // Only the surface meets the surroundings; between nodes conductances are positive (off the diagonal: negative).
    const double outward = net.conductance.row(i).sum();
    EXPECT_NEAR(outward, i + 1 == 4 ? m.surface_conductance : 0.0, 1e-10);
    for (int j = 0; j < i; ++j) EXPECT_LT(net.conductance(i, j), 0.0) << i << ", " << j;
  }
}

TEST(Lumped, ErrorIsPublished) {
  Parameters p;
  p.level = Level::lumped;
  Drive drive = step_scene();
  const double error = largest_gap(run_of(p), reduced_run(4, 1e-8), drive, 300.0);
  Trajectory run = run_of(p);
  run.advance(drive, 300.0);
  EXPECT_LT(error, run.observe(drive).bound);
  EXPECT_GT(30.0 * error, run.observe(drive).bound);
}

TEST(Symmetry, PermutedHeatGivesPermutedTemperatures) {
  for (Level level : {Level::lumped, Level::reduced, Level::full}) {
    Parameters p;
    p.level = level;
    Trajectory run = run_of(p), rotated = run_of(p), mirrored = run_of(p);
    Drive drive, drive_rotated, drive_mirrored;
    const std::array<double, 3> volts{0.5, 1.5, 3.0};
    for (std::size_t i = 0; i < 3; ++i) {
      drive.V[i][0] = volts[i];
      drive_rotated.V[(i + 1) % 3][0] = volts[i];
      drive_mirrored.V[(3 - i) % 3][0] = volts[i];
    }
    run.advance(drive, 10.0);
    rotated.advance(drive_rotated, 10.0);
    mirrored.advance(drive_mirrored, 10.0);
    for (std::size_t i = 0; i < 3; ++i) {
      const double rise = run.observe(drive).rise[i];
      EXPECT_NEAR(rotated.observe(drive).rise[(i + 1) % 3], rise, 1e-10) << "level " << static_cast<int>(level);
      EXPECT_NEAR(mirrored.observe(drive).rise[(3 - i) % 3], rise, 1e-10) << "level " << static_cast<int>(level);
    }
  }
}

TEST(Symmetry, TurningTheSectionAndNamingTcasInAnotherOrderChangesNothing) {
  Parameters p, turned;
  turned.tca.azimuth = {p.tca.azimuth[2] + 0.7, p.tca.azimuth[0] + 0.7 - 6.283185307179586, p.tca.azimuth[1] + 0.7};
  turned.tca.R = {6.9, 6.9, 6.9};
  Trajectory run = run_of(p), other = run_of(turned);
  Drive drive = step_scene(), permuted;
  permuted.V = {drive.V[2], drive.V[0], drive.V[1]};
  run.advance(drive, 10.0);
  other.advance(permuted, 10.0);
  const Observation a = run.observe(drive), b = other.observe(permuted);
  EXPECT_NEAR(b.rise[0], a.rise[2], 1e-10);
  EXPECT_NEAR(b.rise[1], a.rise[0], 1e-10);
  EXPECT_NEAR(b.rise[2], a.rise[1], 1e-10);
}

TEST(Extremes, ContrastsAndTransferOverDecadesKeepTheTolerance) {
  for (double k : {0.19e-3, 190.0})
    for (double rho_c : {1e3, 1e9})
      for (double h : {1e-3, 1e4}) {
        Parameters p;
        p.tca.k = filled(k);
        p.tca.rho_c = filled(rho_c);
        p.h = h;
        p.tolerance = 1e-3;
        Parameters fine = p;
        fine.tolerance = 1e-5;
        const ModalModel coarse = reduced(must(heat_matrices(p, 3)), 1e-2);
        const double rise = coarse.load.col(0).cwiseAbs2().cwiseQuotient(coarse.rate).sum() / p.tca.R[0];
        Drive drive;
        drive.V[0][0] = 1.0;
        const double gap = largest_gap(run_of(p), run_of(fine, 6), drive, 3.0 / coarse.rate[0]);
        EXPECT_LT(gap, 3.0 * p.tolerance * rise) << "k " << k << ", rho_c " << rho_c << ", h " << h;
      }
}

}  // namespace
}  // namespace thermal
