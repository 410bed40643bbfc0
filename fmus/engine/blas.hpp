// Products of small matrices by the BLAS of the caller, called as numpy's dot() calls it, or by plain sums, and the
// norm as Python rounds it.
#pragma once

#include <cstddef>

#include "engine/block.h"

namespace engine {

class Blas {
 public:
  explicit Blas(const TcaBlas& functions) : functions_(functions) {}

  /// y (rows) = A (rows, columns) x; lda: distance of rows in A.
  void times_vector(std::size_t rows, std::size_t columns, const double* A, std::size_t lda, const double* x,
                    double* y) const;
  /// y (columns) = x (rows) A (rows, columns).
  void vector_times(std::size_t rows, std::size_t columns, const double* A, std::size_t lda, const double* x,
                    double* y) const;
  /// y (columns) = x (rows) A (rows, columns), whose columns lie one after the other.
  void vector_times_columns(std::size_t rows, std::size_t columns, const double* A, const double* x, double* y) const;
  /// C (4, n) = A (4, 4) B (4, n).
  void times_matrix(const double* A, const double* B, std::size_t n, double* C) const;

 private:
  void gemv(int order, int transposed, std::size_t rows, std::size_t columns, const double* A, std::size_t lda,
            const double* x, double* y) const;
  double dot(std::size_t n, const double* x, std::size_t step, const double* y) const;

  const TcaBlas& functions_;
};

double norm(const double* v, std::size_t n);

}  // namespace engine
