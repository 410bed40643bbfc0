#include "numerics/arrays.hpp"

#include "numerics/kernel.hpp"

namespace rod {

namespace {

template <class Value>
ROD_INLINE void add_at(int k, int terms, const double* factor, const double* const* x, double* y) {
  auto sum = load<Value>(y + k);
  for (int j = 0; j < terms; ++j) sum += factor[j] * load<Value>(x[j] + k);
  store(y + k, sum);
}

ROD_INLINE void add_all(int n, int terms, const double* factor, const double* const* x, double* y) {
  int k = 0;
  for (; k + kPackSize <= n; k += kPackSize) add_at<Pack>(k, terms, factor, x, y);
  for (; k < n; ++k) add_at<double>(k, terms, factor, x, y);
}

}  // namespace

void add_products(int n, int terms, const double* factor, const double* const* x, double* y) {
  dispatch_exact<add_all>(n, terms, factor, x, y);
}

}  // namespace rod
