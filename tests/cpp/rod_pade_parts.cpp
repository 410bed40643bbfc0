// The parts of the paper's scheme: compact rows, the balance of a section, the banded solver.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "pade/grid_rod.hpp"

using namespace rod;
constexpr int kTcaDim = 3;

TEST(RodPadeScheme, EveryRowIsExactForQuarticsAndEveryIntervalForCubics) {
  for (int n : {5, 6, 9})
    for (int k = 0; k < n; ++k) {
      const pade::DifferenceRow row = pade::compact_row(k, n);
      for (int degree = 0; degree <= 5; ++degree) {
        double error = 0.0;
        for (int j = 0; j < row.count; ++j) {
          const double s = row.first + j;
          error += row.slope[j] * degree * std::pow(s, std::max(degree - 1, 0)) - row.value[j] * std::pow(s, degree);
        }
        if (degree <= 4)
          EXPECT_NEAR(error, 0.0, 1e-10) << "row " << k << " of " << n << ", degree " << degree;
        else
          EXPECT_GT(std::abs(error), 0.1) << "row " << k << " of " << n << " would be of fifth order";
      }
      if (k == n - 1) continue;
      const pade::IntervalRule part = pade::interval_rule(k, n);
      for (int degree = 0; degree <= 3; ++degree) {
        double sum = 0.0;
        for (int j = 0; j < pade::kReach; ++j) sum += part.weight[j] * std::pow(part.first + j, degree);
        EXPECT_NEAR(sum, (std::pow(k + 1, degree + 1) - std::pow(k, degree + 1)) / (degree + 1), 1e-10);
      }
    }
}

TEST(RodPadeScheme, WavesNeitherGrowNorDecayWithTheClosuresChosen) {
  // xi. = eta', eta. = xi' with eta_0 = 0 and xi_{n-1} = 0: rows 0 ... n - 2 give xi., rows 1 ... n - 1 give eta. .
  for (int n : {5, 11, 21, 41}) {
    const int m = n - 1;
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n), B = A;
    for (int k = 0; k < n; ++k) {
      const pade::DifferenceRow row = pade::compact_row(k, n);
      for (int j = 0; j < row.count; ++j)
        A(k, row.first + j) = row.slope[j], B(k, row.first + j) = (n - 1) * row.value[j];
    }
    Eigen::MatrixXd rates = Eigen::MatrixXd::Zero(2 * m, 2 * m);
    rates.topRightCorner(m, m) = A.topLeftCorner(m, m).lu().solve(B.topRightCorner(m, m));
    rates.bottomLeftCorner(m, m) = A.bottomRightCorner(m, m).lu().solve(B.bottomLeftCorner(m, m));
    const Eigen::VectorXcd modes = rates.eigenvalues();
    EXPECT_LT(modes.real().cwiseAbs().maxCoeff(), 1e-9 * modes.cwiseAbs().maxCoeff()) << n << " points";
    EXPECT_NEAR(modes.cwiseAbs().minCoeff(), M_PI / 2, n < 11 ? 1e-3 : 1e-5);

    // The other choice of closures: rates all but undetermined.
    const auto sizes = [](const Eigen::MatrixXd& a) { return a.jacobiSvd().singularValues(); };
    const Eigen::VectorXd chosen = sizes(A.topLeftCorner(m, m)), other = sizes(A.bottomLeftCorner(m, m));
    EXPECT_LT(chosen.maxCoeff() / chosen.minCoeff(), 100.0);
    EXPECT_GT(other.maxCoeff() / other.minCoeff(), std::min(1e12, std::pow(3.0, n - 2)));
  }
}

TEST(RodPadeNode, DerivativesAreExact) {
  std::srand(3);
  pade::ScaledSection section{.stiffness = pade::Vector6::Random().cwiseAbs(),
                              .damping = pade::Vector6::Random().cwiseAbs(),
                              .inertia = pade::Vector6::Random().cwiseAbs(),
                              .reference = pade::Vector6::Unit(5),
                              .mass = 0.7};
  section.inertia.tail<3>().setConstant(0.4);  // a mass is the same in all directions
  for (double spin : {1e-3, 1.0}) {            // both forms of the rotation's coefficients
    pade::PreviousNode before{.z = pade::NodeVector::Random(),
                              .gravity = pade::Vector3::Random(),
                              .stretch = pade::TcaVector::Ones(kTcaDim),
                              .r = {},
                              .r_slope = {}};
    for (std::size_t i = 0; i < 3; ++i)
      before.r[i] = 0.1 * pade::Vector3::Random(), before.r_slope[i] = 0.1 * pade::Vector3::Random();
    pade::NodeVector z = pade::NodeVector::Random();
    z.segment<3>(6) *= spin;
    pade::TcaVector N = pade::TcaVector::Random(kTcaDim);
    pade::NodeEquations exact, ahead, behind;
    node_equations(section, before, z, N, exact);
    const double step = 1e-6;
    for (int j = 0; j < pade::kFields; ++j) {
      const pade::NodeVector e = step * pade::NodeVector::Unit(j);
      node_equations(section, before, z + e, N, ahead);
      node_equations(section, before, z - e, N, behind);
      EXPECT_LT(((ahead.eta_slope - behind.eta_slope) / (2 * step) - exact.eta_slope_z.col(j)).norm(), 1e-8);
      EXPECT_LT(((ahead.W - behind.W) / (2 * step) - exact.W_z.col(j)).norm(), 1e-8);
      EXPECT_LT(((ahead.W_slope - behind.W_slope) / (2 * step) - exact.W_slope_z.col(j)).norm(), 1e-8);
      if (j < 6) {
        EXPECT_LT(((ahead.stretch - behind.stretch) / (2 * step) - exact.stretch_xi.row(j).transpose()).norm(), 1e-8);
      }
    }
    for (int i = 0; i < kTcaDim; ++i) {
      const pade::TcaVector e = step * pade::TcaVector::Unit(kTcaDim, i);
      node_equations(section, before, z, N + e, ahead);
      node_equations(section, before, z, N - e, behind);
      EXPECT_LT(((ahead.W - behind.W) / (2 * step) - exact.W_N.col(i)).norm(), 1e-8);
      EXPECT_LT(((ahead.W_slope - behind.W_slope) / (2 * step) - exact.W_slope_N.col(i)).norm(), 1e-8);
    }
  }
}

TEST(RodPadeSolver, AgreesWithADenseSolverAlsoWhereDiagonalBlocksVanish) {
  constexpr int kFields = pade::kFields, width = pade::kReach * kFields, kColumns = 1 + kTcaDim;
  for (int n : {5, 6, 12}) {
    pade::FrontalSolver solver;
    solver.resize(n, kTcaDim);
    for (int pass = 0; pass < 2; ++pass) {  // the second with the memory of the first
      std::srand(n + pass);
      solver.clear();
      Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n * kFields, n * kFields), B(n * kFields, kColumns);
      int at = 0;
      const auto add = [&](int first, int points, int own) {
        pade::FrontalSolver::Equation& e = solver.add(first);
        for (int c = 0; c < std::min(width, points * kFields); ++c) {
          if (pass == 1 && c / kFields == own) continue;  // no coefficients at the equation's own point
          e.a[c] = A(at, first * kFields + c) = Eigen::internal::random<double>(-1, 1);
        }
        for (int s = 0; s < kColumns; ++s) e.b[s] = B(at, s) = Eigen::internal::random<double>(-1, 1);
        ++at;
      };
      for (int k = 0; k < n; ++k)
        for (int half = 0; half < 2; ++half)
          for (int j = 0; j < kFields / 2; ++j) {
            if (k == 0)
              add(0, half ? pade::kReach : 1, -1);
            else if (k == n - 1)
              half ? add(n - 1, 1, -1) : add(n - 4, pade::kReach, -1);
            else
              add(k - 1, 3, 1);
          }
      ASSERT_EQ(at, n * kFields);
      ASSERT_TRUE(solver.solve());
      const Eigen::MatrixXd x = A.fullPivLu().solve(B);
      for (int u = 0; u < n * kFields; ++u)
        for (int s = 0; s < kColumns; ++s)
          EXPECT_NEAR(solver(u / kFields, u % kFields, s), x(u, s), 1e-8 * x.cwiseAbs().maxCoeff());
    }
    solver.clear();
    for (int k = 0; k < n; ++k)
      for (int j = 0; j < kFields; ++j) solver.add(k == n - 1 ? (j < 6 ? n - 4 : n - 1) : std::max(k - 1, 0));
    EXPECT_FALSE(solver.solve()) << "a singular system must be noticed";
  }
}
