// Factors with a kept elimination order are those that Eigen makes anew, to the last bit.
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
      SymmetricFactor factor(m.stiffness);
      for (const double shift : {0.0, 3e-2}) {
        Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> expected;
        Eigen::SparseMatrix<double> shifted = m.stiffness;
        shifted.diagonal() += shift * m.mass;
        expected.compute(shifted);
        factor.factor(shift * m.mass);
        EXPECT_EQ(factor.solve(m.loads), Eigen::MatrixXd(expected.solve(m.loads)));
        expected.setShift(shift);
        expected.compute(m.stiffness);
        factor.factor(shift);
        EXPECT_EQ(factor.solve(m.loads), Eigen::MatrixXd(expected.solve(m.loads)));
      }
    }
  }
}
