#include "numerics/packed_lu.hpp"

#include <algorithm>
#include <cstddef>

#include "numerics/kernel.hpp"

namespace rod {

namespace {

using PackMemory = Pack __attribute__((may_alias));  // as which an array of doubles is read

/// Solves with both triangles in place; whole packs, since what lies beyond a triangle is 0.
ROD_INLINE void substitute(int n, int packs, const double* lower_triangle, const double* upper_triangle,
                           const double* inverse, double* solution) {
  const auto* lower = reinterpret_cast<const PackMemory*>(lower_triangle);
  const auto* upper = reinterpret_cast<const PackMemory*>(upper_triangle);
  auto* x = reinterpret_cast<PackMemory*>(solution);
  for (int j = 0; j < n; ++j, lower += packs) {
    const double value = solution[j];
    for (int p = j / kPackSize; p < packs; ++p) x[p] -= value * lower[p];
  }
  upper += static_cast<std::ptrdiff_t>(n) * packs;
  for (int j = n - 1; j >= 0; --j) {
    upper -= packs;
    const double value = solution[j] * inverse[j];
    for (int p = 0; p <= j / kPackSize; ++p) x[p] -= value * upper[p];
    solution[j] = value;
  }
}

}  // namespace

void PackedLu::compute(const Eigen::MatrixXd& A) {
  lu_.compute(A);
  const Eigen::MatrixXd& factors = lu_.matrixLU();
  const auto n = static_cast<int>(factors.rows());
  if (inverse_.size() != static_cast<std::size_t>(n)) {
    packs_ = (n + kPackSize - 1) / kPackSize;
    const auto size = static_cast<std::size_t>(n) * static_cast<std::size_t>(packs_);
    lower_.assign(size, {}), upper_.assign(size, {});
    x_.assign(static_cast<std::size_t>(packs_), {});
    inverse_.resize(static_cast<std::size_t>(n));
  }
  for (int j = 0; j < n; ++j) {
    const double* column = factors.data() + static_cast<std::ptrdiff_t>(j) * n;
    const auto start = static_cast<std::size_t>(j) * static_cast<std::size_t>(packs_);
    std::copy_n(column, j, upper_[start].value);
    std::copy_n(column + j + 1, n - j - 1, lower_[start].value + j + 1);
    inverse_[static_cast<std::size_t>(j)] = 1.0 / column[j];
  }
}

void PackedLu::solve(const Eigen::VectorXd& b, Eigen::VectorXd& x) {
  const auto n = static_cast<int>(inverse_.size());
  const auto& moved = lu_.permutationP().indices();
  double* values = x_.data()->value;
  for (int i = 0; i < n; ++i) values[moved[i]] = b[i];
  std::fill(values + n, values + static_cast<std::ptrdiff_t>(packs_) * kPackSize, 0.0);
  dispatch<substitute>(n, packs_, lower_.data()->value, upper_.data()->value, inverse_.data(), values);
  x.resize(n);
  std::copy_n(values, n, x.data());
}

}  // namespace rod
