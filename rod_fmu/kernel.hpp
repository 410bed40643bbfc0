// How the loops over nodes are compiled: one copy for each generation of x86-64 vector units, chosen when the library
// is loaded, so that one portable binary is fast everywhere.
#pragma once

#include <array>

#include "field.hpp"

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

/// out_k = sum_j table[j][k] in_j for each component. In place is allowed.
ROD_INLINE void integrate(const std::array<Lane, nodes>& table, const Field& in, Field& out) {
  Pack x[packs] = {}, y[packs] = {}, z[packs] = {};
  for (int j = 0; j < nodes; ++j) {
    const Vec3 value = in.at(j);
    for (int p = 0; p < packs; ++p) {
      const Pack weight = table.data()[j].pack[p];
      x[p] += weight * value.x;
      y[p] += weight * value.y;
      z[p] += weight * value.z;
    }
  }
  for (int p = 0; p < packs; ++p) out.set(p, {x[p], y[p], z[p]});
}

/// Sum of products over the nodes, in a fixed order.
ROD_INLINE double total(const Lane& w, const Lane& f) {
  Pack sum = {};
  for (int p = 0; p < packs; ++p) sum += w.pack[p] * f.pack[p];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

ROD_INLINE Vec3 total(const Lane& w, const Field& f) { return {total(w, f.x), total(w, f.y), total(w, f.z)}; }

}  // namespace rod
