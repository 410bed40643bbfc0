// The coefficients of the Rosenbrock methods: order conditions of the method and of the one embedded in it, and its
// damping of stiff modes (Hairer and Wanner, Solving ODEs II, IV.7).
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "integration/rosenbrock_tableaus.hpp"

using namespace rod;

namespace {

template <class Pair>
class RodRosenbrock : public testing::Test {
 protected:
  static constexpr int n = Pair::kStages;
  using Table = Eigen::Matrix<double, n, n>;
  using Weights = Eigen::Matrix<double, n, 1>;

  RodRosenbrock() {
    Table A = Table::Zero(), C = Table::Zero();
    for (int i = 1; i < n; ++i) {
      if (i >= Pair::kDirect) A.row(i) = A.row(i - 1), A(i, i - 1) = 1.0;
      for (int j = 0; j < i; ++j) {
        if (i < Pair::kDirect) A(i, j) = Pair::kA[i - 1][j];
        C(i, j) = Pair::kC[i - 1][j];
      }
    }
    const Table inverse = Table::Identity() / Pair::kGamma - C;  // of the matrix of gamma_ij
    const Table gamma = inverse.inverse();
    alpha = A * gamma;  // U = Gamma k
    beta = alpha + gamma;
    embedded = (A.row(n - 1) * gamma).transpose();
    weights = embedded;
    weights += gamma.row(n - 1).transpose();
    node = alpha.rowwise().sum();
    time_weight = gamma.rowwise().sum();
  }

  Table alpha, beta;
  Weights weights, embedded, node, time_weight;
};

using Pairs = testing::Types<Rodas5p, Rodas3>;
TYPED_TEST_SUITE(RodRosenbrock, Pairs);

constexpr double rounding = 1e-10;

}  // namespace

TYPED_TEST(RodRosenbrock, NodesAreThoseOfItsStages) {
  for (int i = 0; i < TypeParam::kStages; ++i) {
    EXPECT_NEAR(this->node[i], TypeParam::kNode[i], rounding);
    EXPECT_NEAR(this->time_weight[i], TypeParam::kTimeWeight[i], rounding);
    EXPECT_TRUE(i >= TypeParam::kShared || TypeParam::kNode[i] == 0.0);
  }
}

TYPED_TEST(RodRosenbrock, ConditionsOfItsOrderHold) {
  const auto one = TestFixture::Weights::Ones();
  const auto& a = this->node;
  const typename TestFixture::Weights a2 = a.cwiseAbs2(), slope = this->beta * one;
  const auto check = [&](const auto& b, int order) {
    EXPECT_NEAR(b.dot(one), 1.0, rounding);
    EXPECT_NEAR(b.dot(slope), 1.0 / 2.0, rounding);
    if (order < 3) return;
    EXPECT_NEAR(b.dot(a2), 1.0 / 3.0, rounding);
    EXPECT_NEAR(b.dot(this->beta * slope), 1.0 / 6.0, rounding);
    if (order < 4) return;
    EXPECT_NEAR(b.dot(a2.cwiseProduct(a)), 1.0 / 4.0, rounding);
    EXPECT_NEAR(b.dot(a.cwiseProduct(this->alpha * slope)), 1.0 / 8.0, rounding);
    EXPECT_NEAR(b.dot(this->beta * a2), 1.0 / 12.0, rounding);
    EXPECT_NEAR(b.dot(this->beta * (this->beta * slope)), 1.0 / 24.0, rounding);
  };
  check(this->weights, TypeParam::kOrder);
  check(this->embedded, TypeParam::kOrder - 1);
}

TYPED_TEST(RodRosenbrock, StiffModesVanish) {
  const Eigen::PartialPivLU<typename TestFixture::Table> beta(this->beta);
  for (const auto& b : {this->weights, this->embedded})
    EXPECT_NEAR(b.dot(beta.solve(TestFixture::Weights::Ones())), 1.0, 1e-9) << "R(infinity) = 0";
}
