// Sums over arrays of doubles of any length and alignment, in an order that no processor changes.
#pragma once

#include <cstring>

#include "numerics/vectors.hpp"

namespace rod {

/// Reads the pack, or the number, at the begin of an array.
template <class Value>
ROD_INLINE Value load(const double* array) {
  Value value;
  std::memcpy(&value, array, sizeof value);
  return value;
}
/// Writes it.
template <class Value>
ROD_INLINE void store(double* array, const Value& value) {
  std::memcpy(array, &value, sizeof value);
}

/// Adds factor[j] x[j], arrays of n numbers, to y for j = 0, 1, ... `terms` - 1, one after the other.
void add_products(int n, int terms, const double* factor, const double* const* x, double* y);

}  // namespace rod
