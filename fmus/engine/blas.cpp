#include "engine/blas.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace engine {

namespace {

enum : int { row_major = 101, column_major = 102, plain = 111, transposed = 112 };  // of CBLAS

template <class Integer>
using Gemv = void(int, int, Integer, Integer, double, const double*, Integer, const double*, Integer, double, double*,
                  Integer);
template <class Integer>
using Gemm = void(int, int, int, Integer, Integer, Integer, double, const double*, Integer, const double*, Integer,
                  double, double*, Integer);
template <class Integer>
using Dot = double(Integer, const double*, Integer, const double*, Integer);

template <class Function>
Function* as(void* address) {
  return reinterpret_cast<Function*>(address);
}

// Calls of one integer type; the caller says which its BLAS has.
template <class Call>
auto with_integers(bool long_ones, Call call) {
  return long_ones ? call(std::int64_t{}) : call(std::int32_t{});
}

void plain_sums(int order, bool transpose, std::size_t rows, std::size_t columns, const double* A, std::size_t lda,
                const double* x, double* y) {
  const std::size_t down = order == row_major ? lda : 1, right = order == row_major ? 1 : lda;
  std::fill_n(y, transpose ? columns : rows, 0.0);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < columns; ++j)
      transpose ? y[j] += x[i] * A[i * down + j * right] : y[i] += A[i * down + j * right] * x[j];
}

}  // namespace

void Blas::gemv(int order, int transpose, std::size_t rows, std::size_t columns, const double* A, std::size_t lda,
                const double* x, double* y) const {
  if (!functions_.gemv) return plain_sums(order, transpose == transposed, rows, columns, A, lda, x, y);
  with_integers(functions_.long_integers, [&](auto integer) {
    using I = decltype(integer);
    as<Gemv<I>>(functions_.gemv)(order, transpose, static_cast<I>(rows), static_cast<I>(columns), 1.0, A,
                                 static_cast<I>(lda), x, 1, 0.0, y, 1);
    return 0;
  });
}

double Blas::dot(std::size_t n, const double* x, std::size_t step, const double* y) const {
  if (!functions_.dot) {
    double sum = 0.0;
    for (std::size_t k = 0; k < n; ++k) sum += x[k * step] * y[k];
    return sum;
  }
  return with_integers(functions_.long_integers, [&](auto integer) {
    using I = decltype(integer);
    return as<Dot<I>>(functions_.dot)(static_cast<I>(n), x, static_cast<I>(step), y, 1);
  });
}

void Blas::times_vector(std::size_t rows, std::size_t columns, const double* A, std::size_t lda, const double* x,
                        double* y) const {
  if (rows == 1)
    *y = dot(columns, A, 1, x);
  else if (columns == 1)
    for (std::size_t i = 0; i < rows; ++i) y[i] = A[i * lda] * x[0];
  else
    gemv(row_major, plain, rows, columns, A, lda, x, y);
}

void Blas::vector_times(std::size_t rows, std::size_t columns, const double* A, std::size_t lda, const double* x,
                        double* y) const {
  if (rows == 1)
    for (std::size_t j = 0; j < columns; ++j) y[j] = 0.0 + x[0] * A[j];
  else if (columns == 1)
    *y = dot(rows, A, lda, x);
  else
    gemv(row_major, transposed, rows, columns, A, lda, x, y);
}

void Blas::vector_times_columns(std::size_t rows, std::size_t columns, const double* A, const double* x,
                                double* y) const {
  if (columns == 1)
    *y = dot(rows, A, 1, x);
  else
    gemv(column_major, transposed, rows, columns, A, rows, x, y);
}

void Blas::times_matrix(const double* A, const double* B, std::size_t n, double* C) const {
  if (n == 1) return gemv(row_major, plain, 4, 4, A, 4, B, C);
  if (!functions_.gemm) {
    std::fill_n(C, 4 * n, 0.0);
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t k = 0; k < 4; ++k)
        for (std::size_t j = 0; j < n; ++j) C[i * n + j] += A[4 * i + k] * B[k * n + j];
    return;
  }
  with_integers(functions_.long_integers, [&](auto integer) {
    using I = decltype(integer);
    const I columns = static_cast<I>(n);
    as<Gemm<I>>(functions_.gemm)(row_major, plain, plain, 4, columns, 4, 1.0, A, 4, B, columns, 0.0, C, columns);
    return 0;
  });
}

// The sum of squares and its root in twice the precision, rounded once.
double norm(const double* v, std::size_t n) {
  double largest = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    if (std::isnan(v[k])) return v[k];
    largest = std::max(largest, std::abs(v[k]));
  }
  if (largest == 0.0 || n == 1 || std::isinf(largest)) return largest;
  int exponent = 0;
  std::frexp(largest, &exponent);
  double sum = 0.0, rest = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    const double x = std::ldexp(v[k], -exponent), square = x * x, lost = std::fma(x, x, -square);
    const double next = sum + square, part = next - sum;
    rest += ((sum - (next - part)) + (square - part)) + lost;
    sum = next;
  }
  const double root = std::sqrt(sum);
  const double correction = (std::fma(-root, root, sum) + rest) / (2.0 * root);
  return std::ldexp(root + correction, exponent);
}

}  // namespace engine

double tca_norm(const double* v, size_t n) { return engine::norm(v, n); }
