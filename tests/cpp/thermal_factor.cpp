// Factors with a kept elimination order, and in kept memory, are those that Eigen makes anew, to the last bit.
#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>

#include "mesh/symmetric_factor.hpp"
#include "thermal_scene.hpp"

using namespace thermal;

TEST(SymmetricFactor, IsThatOfEigen) {
  for (const int order : {3, 4, 3}) {  // the first order again: its elimination order is known by then
    for (const double transfer : {10.0, 25.0}) {
      Parameters p;
      p.h = transfer;
      const HeatMatrices m = must(heat_matrices(p, order));
      const SymmetricFactor by_mass(m.stiffness, m.mass), by_one(m.stiffness, Eigen::VectorXd::Ones(m.size()));
      for (const std::size_t count : {1, 2, 6}) {
        std::vector<double> shifts;
        for (std::size_t k = 0; k < count; ++k) shifts.push_back(3e-2 * static_cast<double>(k));
        const auto added = by_mass.solve(shifts, m.loads), shifted = by_one.solve(shifts, m.loads);
        for (std::size_t k = 0; k < count; ++k) {
          Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> expected;
          Eigen::SparseMatrix<double> sum = m.stiffness;
          sum.diagonal() += shifts[k] * m.mass;
          expected.compute(sum);
          EXPECT_EQ(added[k], Eigen::MatrixXd(expected.solve(m.loads)));
          expected.setShift(shifts[k]);
          expected.compute(m.stiffness);
          EXPECT_EQ(shifted[k], Eigen::MatrixXd(expected.solve(m.loads)));
        }
      }
    }
  }
}

TEST(SymmetricFactor, InKeptMemoryIsTheSame) {
  Parameters p;
  const HeatMatrices m = must(heat_matrices(p, 3));
  const SymmetricFactor factor(m.stiffness, Eigen::VectorXd::Ones(m.size()));
  SymmetricFactor::Factors<1> factors;
  Eigen::VectorXd work(m.size()), x(m.size());
  for (const double shift : {2.0, 0.5, 30.0}) {
    ASSERT_TRUE(factor.factor(shift, factors));
    const Eigen::VectorXd inverse_pivots = factors.pivots.matrix().transpose().cwiseInverse();
    factor.substitute(factors, inverse_pivots, m.loads.col(0), work, x);
    EXPECT_EQ(x, factor.solve(std::vector{shift}, m.loads)[0].col(0));
  }
  const SymmetricFactor singular(Eigen::SparseMatrix<double>(m.stiffness * 0.0), Eigen::VectorXd::Zero(m.size()));
  EXPECT_FALSE(singular.factor(1.0, factors));
}
