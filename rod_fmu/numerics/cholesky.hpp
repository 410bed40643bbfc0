// Cholesky's factorisation of a small symmetric matrix, vectorised: a library's spends most of its time on calls there.
#pragma once

#include <vector>

namespace rod {

/// Factors L L^T of a symmetric matrix (n, n). No allocation while n does not grow.
class Cholesky {
 public:
  /// Copies the symmetric part of a matrix (n, n). Returns the largest entry of what that leaves out, as a share of the
  /// matrix's largest.
  double assign(const double* matrix, int n);
  /// Factors the matrix, with `shift` times d (n) added to the diagonal. Returns false where that is not positive
  /// definite.
  bool factor(double shift = 0.0, const double* d = nullptr);
  /// Solves for the right side x (n), in place.
  void solve(double* x);

 private:
  int n_ = 0, rows_ = 0;         // rows_: n in whole packs; what fills the last one up is zero
  std::vector<double> matrix_;   // (n, rows) the lower triangle
  std::vector<double> columns_;  // (n, rows) L
  std::vector<double> inverse_;  // (n) of the diagonal of L
  std::vector<double> work_;     // (rows) of a right side
};

}  // namespace rod
