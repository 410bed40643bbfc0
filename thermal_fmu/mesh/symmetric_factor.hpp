// Sparse L D L' factors of one symmetric matrix plus multiples of a diagonal, for several multiples at once. Where
// entries lie is found once per pattern and kept by the process: meshes that differ in their numbers only, as in a
// sweep, share it.
#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <span>
#include <vector>

namespace thermal {

/// Elimination order of a pattern and the pattern of its factor L, a lower triangle without its diagonal of ones.
struct EliminationOrder {
  std::vector<int> columns, rows;               // of the matrix that it belongs to, as Eigen stores it
  Eigen::PermutationMatrix<Eigen::Dynamic> to;  // from the matrix's numbers to those of elimination

  // The strict upper triangle of the permuted matrix, column by column.
  std::vector<int> upper_begin, upper_row;
  std::vector<Eigen::Index> upper_source;  // entry of the matrix
  std::vector<Eigen::Index> diagonal_source;

  std::vector<int> lower_begin, lower_row;  // L, column by column
  // The same row by row, in the order of a substitution: column of each entry, and its position among those of L.
  std::vector<int> reach_begin, reach_column, reach_position;
};

class SymmetricFactor {
 public:
  using SparseMatrix = Eigen::SparseMatrix<double>;

  /// Reads a compressed matrix that stores both triangles.
  SymmetricFactor(const SparseMatrix& matrix, const Eigen::VectorXd& weights);

  /// (matrix + shift diag(weights))^-1 right for each shift.
  std::vector<Eigen::MatrixXd> solve(std::span<const double> shifts, const Eigen::MatrixXd& right) const;

  /// Factors for several shifts at once, one to a row.
  template <int lanes>
  struct Factors {
    Eigen::Array<double, lanes, Eigen::Dynamic> lower, pivots, row;  // L, D, and zeros between factorings
  };

  /// Factors of matrix + shift diag(weights), in memory that the next shift can use. False: a pivot is zero.
  bool factor(double shift, Factors<1>& factors) const;
  /// x = (L D' L')^-1 b with D' = 1/inverse_pivots; x and b are in the order of the matrix, work and pivots in that of
  /// elimination.
  void substitute(const Factors<1>& factors, const Eigen::VectorXd& inverse_pivots,
                  const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::VectorXd& work,
                  Eigen::Ref<Eigen::VectorXd> x) const;

 private:
  template <int lanes>
  void factor(const Eigen::Array<double, lanes, 1>& shift, Factors<lanes>& factors) const;
  template <int lanes>
  void solve(const double* shifts, const Eigen::MatrixXd& right, std::span<Eigen::MatrixXd> solutions) const;

  std::shared_ptr<const EliminationOrder> order_;
  std::vector<double> upper_;               // entries of the permuted strict upper triangle
  std::vector<double> diagonal_, weights_;  // in the order of elimination
};

}  // namespace thermal
