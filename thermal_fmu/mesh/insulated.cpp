#include "mesh/insulated.hpp"

#include <Eigen/SparseCholesky>
#include <vector>

namespace thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

/// The matrix with row and column `pin` replaced by those of the identity.
SparseMatrix pinned(const SparseMatrix& matrix, Index pin) {
  std::vector<Eigen::Triplet<double>> entries{{static_cast<int>(pin), static_cast<int>(pin), 1.0}};
  entries.reserve(static_cast<std::size_t>(matrix.nonZeros()));
  for (Index column = 0; column < matrix.outerSize(); ++column)
    for (SparseMatrix::InnerIterator entry(matrix, column); entry; ++entry)
      if (entry.row() != pin && entry.col() != pin)
        entries.emplace_back(static_cast<int>(entry.row()), static_cast<int>(entry.col()), entry.value());
  SparseMatrix result(matrix.rows(), matrix.cols());
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

}  // namespace

// With T = T_pin 1 + D, D_pin = 0, and stiffness 1 = surface (exactly: conduction alone leaves uniform temperatures
// alone), the rows but `pin` read  stiffness_rr D = load - surface T_pin,  and the sum of all rows reads
// surface' D + h S T_pin = 1 W.
MatrixXd rises_above_surface(const HeatSystem& m) {
  const Index tcas = m.loads.cols() - 1;
  const auto surface = m.loads.col(tcas);
  const double conductance = surface.sum();
  Index pin = 0;
  surface.maxCoeff(&pin);
  const Eigen::SimplicialLDLT<SparseMatrix> factor(pinned(m.stiffness, pin));
  MatrixXd loads = m.loads;
  loads.row(pin).setZero();
  const MatrixXd solved = factor.solve(loads);
  const auto by_surface = solved.col(tcas);
  MatrixXd above = solved.leftCols(tcas);
  for (Index i = 0; i < above.cols(); ++i) {
    const double at_pin = (1.0 - surface.dot(above.col(i))) / (conductance - surface.dot(by_surface));
    above.col(i) -= by_surface * at_pin;
    above.col(i).array() -= surface.dot(above.col(i)) / conductance;
  }
  return above;
}

}  // namespace thermal
