// Sparse L D L' factors of one symmetric matrix plus diagonals. The order of elimination is found once per pattern and
// kept by the process: meshes that differ in their numbers only, as in a sweep, share it.
#pragma once

#include <Eigen/SparseCholesky>
#include <memory>
#include <vector>

namespace thermal {

using LdlSolver =
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Upper, Eigen::NaturalOrdering<int>>;  // of permuted ones

/// Elimination order of a pattern, and where the entries of the lower triangle lie in the permuted upper one.
struct EliminationOrder {
  std::vector<int> columns, rows;               // of the matrix that it belongs to, as Eigen stores it
  Eigen::PermutationMatrix<Eigen::Dynamic> to;  // from the matrix's numbers to those of elimination
  Eigen::SparseMatrix<double> upper;            // pattern of the permuted upper triangle
  std::vector<Eigen::Index> source;             // entry of the matrix for each of these
  std::vector<Eigen::Index> diagonal;           // entry of `upper` for each row of the matrix
  // Solvers that know the pattern, and that no factor uses now.
  mutable std::vector<std::unique_ptr<LdlSolver>> idle;
};

class SymmetricFactor {
 public:
  using SparseMatrix = Eigen::SparseMatrix<double>;

  /// Reads a compressed matrix that stores both triangles; factor() comes before solve().
  explicit SymmetricFactor(const SparseMatrix& matrix);
  ~SymmetricFactor();
  SymmetricFactor(SymmetricFactor&&) = default;

  /// Factors the matrix plus a diagonal.
  void factor(const Eigen::VectorXd& added);
  /// Factors the matrix plus a multiple of the identity.
  void factor(double shift = 0.0);
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;

 private:
  std::shared_ptr<const EliminationOrder> order_;
  SparseMatrix upper_;
  std::vector<double> diagonal_;  // of the matrix
  std::unique_ptr<LdlSolver> ldlt_;
};

}  // namespace thermal
