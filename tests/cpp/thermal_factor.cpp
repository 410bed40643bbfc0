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
