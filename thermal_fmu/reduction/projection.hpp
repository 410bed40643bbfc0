// Galerkin projection of the symmetric system x' = -A x + B w on a space, with the Gram matrix of its residual.
#pragma once

#include <Eigen/SparseCore>

namespace thermal {

/// Orthonormal basis, grown by blocks; directions that add nothing beyond rounding are dropped.
class Basis {
 public:
  explicit Basis(Eigen::Index rows) : memory_(rows, kFirstColumns) {}

  void add(const Eigen::MatrixXd& block);
  Eigen::MatrixXd::ConstColsBlockXpr columns() const { return memory_.leftCols(count_); }

 private:
  static constexpr double kDropped = 1e-10;
  static constexpr Eigen::Index kFirstColumns = 64;  // room for those of the first shifts
  Eigen::MatrixXd memory_;
  Eigen::Index count_ = 0;
};

/// A projected system in its eigenvectors, with the Gram matrix F' F of its residual.
struct Projection {
  Eigen::VectorXd rate;
  Eigen::MatrixXd load;
  Eigen::MatrixXd vectors;  // of the projected matrix
  Eigen::MatrixXd residual_gram;

  /// |rho_j|^2 in L2 for every load.
  Eigen::VectorXd residual_squares() const;
};

Projection project(const Eigen::SparseMatrix<double>& a, const Eigen::MatrixXd& b, const Eigen::MatrixXd& basis);

/// The same for an insulated section, where the first basis vector is the uniform temperature and its image is known.
Projection project(const Eigen::SparseMatrix<double>& a, const Eigen::MatrixXd& b, const Eigen::MatrixXd& basis,
                   const Eigen::VectorXd& first_image);

/// The subspace W (orthonormal columns) of an already projected system. `is_graded`: W is the first mode and others.
Projection project(const Projection& from, const Eigen::MatrixXd& w, bool is_graded);

}  // namespace thermal
