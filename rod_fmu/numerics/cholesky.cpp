#include "numerics/cholesky.hpp"

#include <algorithm>
#include <cmath>

#include "numerics/kernel.hpp"

namespace rod {

namespace {

/// A pack anywhere in an array of doubles.
using LoosePack = double __attribute__((vector_size(kPackSize * sizeof(double)), aligned(alignof(double)), may_alias));

ROD_INLINE Pack load(const double* from) { return *reinterpret_cast<const LoosePack*>(from); }
ROD_INLINE void store(double* to, const Pack& pack) { *reinterpret_cast<LoosePack*>(to) = pack; }
ROD_INLINE int first_of_pack(int row) { return row / kPackSize * kPackSize; }

/// Subtracts from `count` packs of column j, from row `first` on, what the columns before it contribute.
template <int count>
ROD_INLINE void subtract(double* columns, int rows, int j, int first) {
  Pack sum[count];
  for (int p = 0; p < count; ++p) sum[p] = load(columns + j * rows + first + p * kPackSize);
  for (int k = 0; k < j; ++k) {
    const double* column = columns + k * rows;
    for (int p = 0; p < count; ++p) sum[p] -= load(column + first + p * kPackSize) * column[j];
  }
  for (int p = 0; p < count; ++p) store(columns + j * rows + first + p * kPackSize, sum[p]);
}

/// The same for all packs from row `first` on.
ROD_INLINE void subtract(double* columns, int rows, int j, int first) {
  for (; first + 4 * kPackSize <= rows; first += 4 * kPackSize) subtract<4>(columns, rows, j, first);
  switch ((rows - first) / kPackSize) {
    case 3:
      return subtract<3>(columns, rows, j, first);
    case 2:
      return subtract<2>(columns, rows, j, first);
    case 1:
      return subtract<1>(columns, rows, j, first);
  }
}

ROD_INLINE bool factor_columns(double* columns, int n, int rows, double* inverse) {
  for (int j = 0; j < n; ++j) {
    double* column = columns + j * rows;
    const int begin = first_of_pack(j);
    subtract(columns, rows, j, begin);
    if (!(column[j] > 0.0)) return false;
    inverse[j] = 1.0 / std::sqrt(column[j]);
    std::fill(column + begin, column + j, 0.0);
    for (int i = begin; i < rows; i += kPackSize) store(column + i, load(column + i) * inverse[j]);
  }
  return true;
}

ROD_INLINE void solve_columns(const double* columns, int n, int rows, const double* inverse, double* x) {
  for (int j = 0; j < n; ++j) {
    const double* column = columns + j * rows;
    const double value = x[j] * inverse[j];
    for (int i = first_of_pack(j); i < rows; i += kPackSize) store(x + i, load(x + i) - load(column + i) * value);
    x[j] = value;
  }
  for (int j = n - 1; j >= 0; --j) {
    const double* column = columns + j * rows;
    const double right = x[j];
    x[j] = 0.0;
    Pack sum{};
    for (int i = first_of_pack(j); i < rows; i += kPackSize) sum += load(column + i) * load(x + i);
    x[j] = (right - ((sum[0] + sum[1]) + (sum[2] + sum[3]))) * inverse[j];
  }
}

}  // namespace

double Cholesky::assign(const double* matrix, int n) {
  n_ = n, rows_ = first_of_pack(n + kPackSize - 1);
  matrix_.resize(static_cast<std::size_t>(n) * static_cast<std::size_t>(rows_));
  inverse_.resize(static_cast<std::size_t>(n));
  work_.assign(static_cast<std::size_t>(rows_), 0.0);
  double largest = 0.0, left_out = 0.0;
  for (int j = 0; j < n; ++j) {
    double* column = matrix_.data() + j * rows_;
    std::fill(column + first_of_pack(j), column + j, 0.0);
    std::fill(column + n, column + rows_, 0.0);
    for (int i = j; i < n; ++i) {
      const double below = matrix[j * n + i], above = matrix[i * n + j];
      column[i] = 0.5 * (below + above);
      largest = std::max({largest, std::abs(below), std::abs(above)});
      left_out = std::max(left_out, std::abs(below - column[i]));
    }
  }
  return left_out / largest;
}

bool Cholesky::factor(double shift, const double* d) {
  columns_ = matrix_;
  double* diagonal = columns_.data();
  if (d)
    for (int j = 0; j < n_; ++j, diagonal += rows_ + 1) *diagonal += shift * d[j];
  return dispatch<factor_columns>(columns_.data(), n_, rows_, inverse_.data());
}

void Cholesky::solve(double* x) {
  std::copy_n(x, n_, work_.data());
  dispatch<solve_columns>(columns_.data(), n_, rows_, inverse_.data(), work_.data());
  std::copy_n(work_.data(), n_, x);
}

}  // namespace rod
