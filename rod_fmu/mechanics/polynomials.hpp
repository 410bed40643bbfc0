// Strain polynomials at the nodes, and moments of densities with them.
#pragma once

#include "mechanics/loops.hpp"
#include "numerics/kernel.hpp"

namespace rod {

/// Adds sum_a coefficient[a] table[a] of strain component i.
template <int packs, class Tables>
ROD_INLINE void expand(const Build& build, int i, const double* coefficients, const Tables& tables, Lane& out) {
  for (int p = 0; p < packs; ++p) {
    Pack sum = out.pack[p];
    for (int a = 0; a < build.terms; ++a) sum += coefficients[a * build.count + i] * tables[a].pack[p];
    out.pack[p] = sum;
  }
}

/// Adds strains (or their rates) at the nodes.
template <int packs>
ROD_INLINE void expand(const Build& build, const double* coefficients, Field& kappa, Field& lambda) {
  for (int i = 0; i < build.count; ++i) {
    const int c = build.components[i];
    expand<packs>(build, i, coefficients, build.grid->legendre, lane(c < 3 ? kappa : lambda, c % 3));
  }
}

/// r = sign * int Phi^T [couple; force].
template <int packs>
ROD_INLINE void moments(const Build& build, const Field& couple, const Field& force, double sign, double* r) {
  for (int i = 0; i < build.count; ++i) {
    const int c = build.components[i];
    const Lane& density = lane(c < 3 ? couple : force, c % 3);
    for (int a = 0; a < build.terms; ++a) r[a * build.count + i] = sign * total<packs>(build.grid->moment[a], density);
  }
}

}  // namespace rod
