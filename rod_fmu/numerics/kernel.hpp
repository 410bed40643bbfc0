// Dispatch of the loops over nodes: each is compiled twice, with and without AVX2 and FMA, and the processor decides
// which is called, so that one portable binary is fast everywhere. Also integrals and sums over the nodes.
#pragma once

#include <array>
#include <cmath>

#include "numerics/field.hpp"

#define ROD_LAMBDA_INLINE __attribute__((always_inline))

namespace rod {

#ifdef __x86_64__
inline const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#endif

/// The versions of an inlined kernel. The choice between them is made here because the loader of Windows makes none.
template <auto kernel>
struct Dispatch;

template <class Result, class... Arguments, Result (*kernel)(Arguments...)>
struct Dispatch<kernel> {
#ifdef __x86_64__
  __attribute__((target("avx2,fma"))) static Result fused(Arguments... arguments) { return kernel(arguments...); }
  __attribute__((target("avx2"))) static Result exact(Arguments... arguments) { return kernel(arguments...); }
  static Result portable(Arguments... arguments) { return kernel(arguments...); }
  template <bool is_exact>
  static Result call(Arguments... arguments) {
    if (!has_avx2) return portable(arguments...);
    if constexpr (is_exact)
      return exact(arguments...);
    else
      return fused(arguments...);
  }
#else
  template <bool>
  static Result call(Arguments... arguments) {
    return kernel(arguments...);
  }
#endif
};

/// dispatch<kernel>(arguments...) is kernel(arguments...), with AVX2 and FMA where there are any.
template <auto kernel>
inline constexpr auto dispatch = &Dispatch<kernel>::template call<false>;

/// dispatch_exact<kernel> is the same with AVX2 alone: no product is fused with a sum, so every processor gives the
/// same bits.
template <auto kernel>
inline constexpr auto dispatch_exact = &Dispatch<kernel>::template call<true>;

/// A local array of a kernel: a vector of type V at every node.
template <class V, std::size_t packs>
using NodeArray = std::array<V, packs>;

ROD_INLINE Pack square_root(const Pack& square) {
  return Pack{std::sqrt(square[0]), std::sqrt(square[1]), std::sqrt(square[2]), std::sqrt(square[3])};
}

namespace detail {
ROD_INLINE double at(const Pack& a, int k) { return a[k]; }
ROD_INLINE Zero at(Zero, int) { return {}; }
}  // namespace detail

/// Integral of f by a table of the quadrature: sum_j table[j][k] f_j at every node k, for each component.
template <class V, std::size_t packs>
ROD_INLINE NodeArray<V, packs> integral(const std::array<ScalarField, kMaxNodes>& table, const NodeArray<V, packs>& f) {
  NodeArray<V, packs> sum{};
  for (int j = 0; j < static_cast<int>(packs) * kPackSize; ++j) {
    const V& source = f[j / kPackSize];
    const int k = j % kPackSize;
    const Triad value{detail::at(source.x, k), detail::at(source.y, k), detail::at(source.z, k)};
    for (std::size_t p = 0; p < packs; ++p) {
      const Pack weight = table.data()[j].pack[p];
      sum[p] = {sum[p].x + weight * value.x, sum[p].y + weight * value.y, sum[p].z + weight * value.z};
    }
  }
  return sum;
}

/// Sum of w f over the nodes, in a fixed order.
template <int packs = kMaxPacks>
ROD_INLINE double weighted_sum(const ScalarField& w, const ScalarField& f) {
  Pack sum = {};
  for (int p = 0; p < packs; ++p) sum += w.pack[p] * f.pack[p];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

ROD_INLINE Vec3 weighted_sum(const ScalarField& w, const VectorField& f) {
  return {weighted_sum(w, f.x), weighted_sum(w, f.y), weighted_sum(w, f.z)};
}

}  // namespace rod
