// The factorisation of small symmetric matrices, against Eigen's.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Dense>

#include "numerics/cholesky.hpp"

using namespace rod;

namespace {

class RodCholesky : public testing::TestWithParam<int> {
 protected:
  const int n = GetParam();
  const Eigen::MatrixXd random = Eigen::MatrixXd::Random(n, n);
  const Eigen::MatrixXd A = random * random.transpose() + Eigen::MatrixXd::Identity(n, n);
  Cholesky factors;
};

TEST_P(RodCholesky, SolvesAsEigenDoes) {
  EXPECT_LE(factors.assign(A.data(), n), 1e-15);
  ASSERT_TRUE(factors.factor());
  const Eigen::VectorXd right = Eigen::VectorXd::Random(n), expected = A.llt().solve(right);
  Eigen::VectorXd x = right;
  factors.solve(x.data());
  EXPECT_LE((x - expected).norm(), 1e-12 * expected.norm());
  x = right;  // the second of several solves
  factors.solve(x.data());
  EXPECT_LE((A * x - right).norm(), 1e-12 * A.norm() * x.norm());
}

TEST_P(RodCholesky, TakesTheSymmetricPartAndSaysWhatThatLeavesOut) {
  Eigen::MatrixXd skew = A;
  if (n > 1) skew(n - 1, 0) += 0.2, skew(0, n - 1) -= 0.2;
  const double share = factors.assign(skew.data(), n);
  EXPECT_NEAR(share, n > 1 ? 0.2 / skew.cwiseAbs().maxCoeff() : 0.0, 1e-15);
  ASSERT_TRUE(factors.factor());
  Eigen::VectorXd x = Eigen::VectorXd::Ones(n);
  factors.solve(x.data());
  EXPECT_LE((A * x - Eigen::VectorXd::Ones(n)).norm(), 1e-12 * A.norm() * x.norm());
}

TEST_P(RodCholesky, DecidesWhetherAShiftedMatrixIsDefinite) {
  const Eigen::VectorXd d = Eigen::VectorXd::Ones(n);
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(A).eigenvalues()(0);
  factors.assign(A.data(), n);
  EXPECT_TRUE(factors.factor(-0.999 * least, d.data()));
  EXPECT_FALSE(factors.factor(-1.001 * least, d.data()));
  EXPECT_TRUE(factors.factor()) << "the matrix itself is kept";
  const Eigen::MatrixXd bad = Eigen::MatrixXd::Constant(n, n, std::numeric_limits<double>::quiet_NaN());
  factors.assign(bad.data(), n);
  EXPECT_FALSE(factors.factor());
}

INSTANTIATE_TEST_SUITE_P(Sizes, RodCholesky, testing::Values(1, 2, 3, 4, 5, 12, 17, 30, 48, 61));

}  // namespace
