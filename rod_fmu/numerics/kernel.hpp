// How the loops over nodes are compiled: one copy for each generation of x86-64 vector units, chosen when the library
// is loaded, so that one portable binary is fast everywhere.
#pragma once

#include <array>
#include <cmath>

#include "numerics/field.hpp"

#define ROD_LAMBDA_INLINE __attribute__((always_inline))

namespace rod {

#ifdef __x86_64__
inline const bool has_wide_units = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#endif

/// fastest<kernel>(arguments...) is kernel(arguments...) for an inlined kernel, with AVX2 and FMA where there are any.
/// The choice is made here because the loader of Windows makes none.
template <auto kernel>
struct Fastest;

template <class Result, class... Arguments, Result (*kernel)(Arguments...)>
struct Fastest<kernel> {
#ifdef __x86_64__
  __attribute__((target("avx2,fma"))) static Result wide(Arguments... arguments) { return kernel(arguments...); }
  static Result plain(Arguments... arguments) { return kernel(arguments...); }
  static Result run(Arguments... arguments) { return has_wide_units ? wide(arguments...) : plain(arguments...); }
#else
  static Result run(Arguments... arguments) { return kernel(arguments...); }
#endif
};

template <auto kernel>
inline constexpr auto fastest = &Fastest<kernel>::run;

/// A vector at every node of a kernel's own, with the components that V has.
template <class V, std::size_t packs>
using Along = std::array<V, packs>;

ROD_INLINE Pack root(const Pack& square) {
  return Pack{std::sqrt(square[0]), std::sqrt(square[1]), std::sqrt(square[2]), std::sqrt(square[3])};
}

namespace detail {
ROD_INLINE double at(const Pack& a, int k) { return a[k]; }
ROD_INLINE Zero at(Zero, int) { return {}; }
}  // namespace detail

/// sum_j table[j][k] f_j at every node k, for each component.
template <class V, std::size_t packs>
ROD_INLINE Along<V, packs> integral(const std::array<Lane, most_nodes>& table, const Along<V, packs>& f) {
  Along<V, packs> sum{};
  for (int j = 0; j < static_cast<int>(packs) * pack_size; ++j) {
    const V& source = f[j / pack_size];
    const int k = j % pack_size;
    const Triad value{detail::at(source.x, k), detail::at(source.y, k), detail::at(source.z, k)};
    for (std::size_t p = 0; p < packs; ++p) {
      const Pack weight = table.data()[j].pack[p];
      sum[p] = {sum[p].x + weight * value.x, sum[p].y + weight * value.y, sum[p].z + weight * value.z};
    }
  }
  return sum;
}

/// Sum of products over the nodes, in a fixed order.
template <int packs = most_packs>
ROD_INLINE double total(const Lane& w, const Lane& f) {
  Pack sum = {};
  for (int p = 0; p < packs; ++p) sum += w.pack[p] * f.pack[p];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

ROD_INLINE Vec3 total(const Lane& w, const Field& f) { return {total(w, f.x), total(w, f.y), total(w, f.z)}; }

}  // namespace rod
