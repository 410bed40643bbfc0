#include "reduction/projection.hpp"

#include <Eigen/Eigenvalues>

#include "reduction/graded_eigen.hpp"

namespace thermal {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

void Basis::add(const MatrixXd& block) {
  for (Index j = 0; j < block.cols(); ++j) {
    VectorXd v = block.col(j).normalized();
    for (int pass = 0; pass < 2; ++pass) v -= columns() * (columns().transpose() * v);
    const double rest = v.norm();
    if (rest < kDropped) continue;
    v /= rest;
    v -= columns() * (columns().transpose() * v);
    if (count_ == memory_.cols()) memory_.conservativeResize(Eigen::NoChange, 2 * count_);
    memory_.col(count_++) = v.normalized();
  }
}

VectorXd Projection::residual_squares() const {
  MatrixXd product(rate.size(), rate.size());
  for (Index l = 0; l < rate.size(); ++l)
    for (Index k = 0; k < rate.size(); ++k) product(k, l) = residual_gram(k, l) / (rate[k] + rate[l]);
  const MatrixXd weights = rate.cwiseInverse().asDiagonal() * load;
  return weights.cwiseProduct(product * weights).colwise().sum().cwiseMax(0.0);
}

Projection project(const SparseMatrix& a, const MatrixXd& b, const MatrixXd& basis) {
  const MatrixXd image = a * basis;
  const MatrixXd small = basis.transpose() * image;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(small);
  Projection p{
      eigen.eigenvalues(), eigen.eigenvectors().transpose() * (basis.transpose() * b), eigen.eigenvectors(), {}};
  const MatrixXd residual = (image - basis * small) * p.vectors;
  p.residual_gram = residual.transpose() * residual;
  return p;
}

Projection project(const SparseMatrix& a, const MatrixXd& b, const MatrixXd& basis, const VectorXd& first_image) {
  MatrixXd image = a * basis;
  image.col(0) = first_image;
  MatrixXd small = basis.transpose() * image;
  small.row(0) = small.col(0).transpose();
  const Eigenpairs eigen = graded_eigenpairs(small);
  Projection p{eigen.values, eigen.vectors.transpose() * (basis.transpose() * b), eigen.vectors, {}};
  const MatrixXd residual = (image - basis * small) * p.vectors;
  p.residual_gram = residual.transpose() * residual;
  return p;
}

Projection project(const Projection& from, const MatrixXd& w, bool is_graded) {
  const MatrixXd small = w.transpose() * from.rate.asDiagonal() * w;
  Projection p;
  if (is_graded) {
    const Eigenpairs eigen = graded_eigenpairs(small);
    p = {eigen.values, {}, w * eigen.vectors, {}};
  } else {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(small);
    p = {eigen.eigenvalues(), {}, w * eigen.eigenvectors(), {}};
  }
  p.load = p.vectors.transpose() * from.load;
  const MatrixXd inner = from.rate.asDiagonal() * p.vectors - p.vectors * p.rate.asDiagonal();
  p.residual_gram = p.vectors.transpose() * from.residual_gram * p.vectors + inner.transpose() * inner;
  return p;
}

}  // namespace thermal
