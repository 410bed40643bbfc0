// Strain polynomials at the nodes, xi = xi* + Phi q, and the projection of densities onto them, int Phi^T f ds.
#pragma once

#include "mechanics/loops.hpp"
#include "numerics/kernel.hpp"

namespace rod {

/// Adds sum_a q_a,i table[a], with the coefficients of strain component i.
template <int packs, class Tables>
ROD_INLINE void add_expansion(const RodConstants& rod, int i, const double* coefficients, const Tables& tables,
                              ScalarField& out) {
  for (int p = 0; p < packs; ++p) {
    Pack sum = out.pack[p];
    for (int a = 0; a < rod.terms; ++a) sum += coefficients[a * rod.count + i] * tables[a].pack[p];
    out.pack[p] = sum;
  }
}

/// Adds strains (or their rates) at the nodes.
template <int packs>
ROD_INLINE void add_expansion(const RodConstants& rod, const double* coefficients, VectorField& kappa,
                              VectorField& lambda) {
  for (int i = 0; i < rod.count; ++i) {
    const int c = rod.components[i];
    add_expansion<packs>(rod, i, coefficients, rod.grid->legendre, component(c < 3 ? kappa : lambda, c % 3));
  }
}

/// Writes r = sign * int Phi^T [couple; force] ds.
template <int packs>
ROD_INLINE void project(const RodConstants& rod, const VectorField& couple, const VectorField& force, double sign,
                        double* r) {
  for (int i = 0; i < rod.count; ++i) {
    const int c = rod.components[i];
    const ScalarField& density = component(c < 3 ? couple : force, c % 3);
    for (int a = 0; a < rod.terms; ++a) r[a * rod.count + i] = sign * weighted_sum<packs>(rod.grid->moment[a], density);
  }
}

}  // namespace rod
