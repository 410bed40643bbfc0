// Eigenpairs of a symmetric matrix whose first row and column are smaller than the rest by orders of magnitude.
//
// A standard solver is accurate to rounding of the largest eigenvalue; here the smallest one is needed to rounding of
// itself. With the blocks [a, c'; c, S] its eigenvector is [1; w], w = -(S - value)^-1 c, value = a + c' w: a fixed
// point that contracts with (value / least eigenvalue of S). The others follow on its orthogonal complement.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace thermal {

struct Eigenpairs {
  Eigen::VectorXd values;   // ascending
  Eigen::MatrixXd vectors;  // columns, orthonormal
};

inline Eigenpairs graded_eigenpairs(const Eigen::MatrixXd& matrix) {
  using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;
  constexpr int kIterations = 8;  // the contraction is 1e-3 or less: rounding is reached after 5
  const Index m = matrix.rows() - 1;
  const MatrixXd S = matrix.bottomRightCorner(m, m);
  const VectorXd c = matrix.col(0).tail(m);
  VectorXd w = VectorXd::Zero(m);
  double least = matrix(0, 0);
  for (int k = 0; k < kIterations; ++k) {
    w = -(S - least * MatrixXd::Identity(m, m)).ldlt().solve(c);
    least = matrix(0, 0) + c.dot(w);
  }
  // Columns 2.. of the reflection that takes e_1 to the eigenvector's direction span its complement.
  const double size = std::sqrt(1.0 + w.squaredNorm());
  VectorXd v(m + 1), mirror(m + 1);
  v << 1.0 / size, w / size;
  mirror << 1.0 + v[0], v.tail(m);
  MatrixXd complement = MatrixXd::Identity(m + 1, m + 1).rightCols(m);
  complement -= (2.0 / mirror.squaredNorm()) * mirror * mirror.tail(m).transpose();
  const MatrixXd rest = complement.transpose() * matrix * complement;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(rest);
  Eigenpairs result{VectorXd(m + 1), MatrixXd(m + 1, m + 1)};
  result.values << least, eigen.eigenvalues();
  result.vectors << v, complement * eigen.eigenvectors();
  return result;
}

}  // namespace thermal
