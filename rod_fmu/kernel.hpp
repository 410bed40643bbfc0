// How the loops over nodes are compiled: one copy for each generation of x86-64 vector units, chosen when the library
// is loaded, so that one portable binary is fast everywhere.
#pragma once

#include "field.hpp"

#if defined(__x86_64__) && defined(__gnu_linux__)
#define ROD_KERNEL __attribute__((target_clones("arch=skylake-avx512", "arch=haswell", "default")))
#else
#define ROD_KERNEL
#endif
#define ROD_INLINE [[gnu::always_inline]] inline

namespace rod {

/// out_k = sum_j table[j][k] in_j. In place is allowed.
ROD_INLINE void integrate(const std::array<Lane, nodes>& table, const Lane& in, Lane& out) {
  double sum[nodes] = {};
  for (int j = 0; j < nodes; ++j)
    for (int k = 0; k < nodes; ++k) sum[k] += table[j][k] * in[j];
  for (int k = 0; k < nodes; ++k) out[k] = sum[k];
}

ROD_INLINE void integrate(const std::array<Lane, nodes>& table, const Field& in, Field& out) {
  integrate(table, in.x, out.x);
  integrate(table, in.y, out.y);
  integrate(table, in.z, out.z);
}

/// Weighted sum over the nodes, in a fixed order.
ROD_INLINE double total(const Lane& w, const Lane& f) {
  double sum = 0.0;
  for (int k = 0; k < nodes; ++k) sum += w[k] * f[k];
  return sum;
}

ROD_INLINE Vec3 total(const Lane& w, const Field& f) { return {total(w, f.x), total(w, f.y), total(w, f.z)}; }

}  // namespace rod
