// Terms of the exact derivatives of the residual: its chain of integrals, linearised. A variation of the strains turns
// every section by dtheta(s) = int_0^s R dkappa ds and changes p' by dtheta x p' + R dlambda; the rest follows from the
// product rule.
// Parts of a variation that vanish (shear does not rotate a section, rates do not change the shape) have the type Zero
// and cost nothing.
#pragma once

#include "mechanics/residual_terms.hpp"

namespace rod {

/// The same vectors with all components written out.
template <int packs, class V>
ROD_INLINE NodeArray<Triad<Pack>, packs> widen(const NodeArray<V, packs>& f) {
  NodeArray<Triad<Pack>, packs> out{};
  for (int p = 0; p < packs; ++p) {
    if constexpr (Number<decltype(V::x)>) out[p].x = f[p].x;
    if constexpr (Number<decltype(V::y)>) out[p].y = f[p].y;
    if constexpr (Number<decltype(V::z)>) out[p].z = f[p].z;
  }
  return out;
}

using ZeroVector = Triad<Zero>;

/// f(p) for every pack p.
template <int packs, class F>
ROD_INLINE auto for_each_pack(const F& f) {
  NodeArray<decltype(f(0)), packs> out;
  for (int p = 0; p < packs; ++p) out[p] = f(p);
  return out;
}

/// Variation by one coefficient of the strains: its polynomial times an axis of the section, in the fixed frame. k, k1,
/// k2 are R dkappa L and the same of its rates; l, l1, l2 are R dlambda and the same of its rates. The rotation of the
/// section by the variation itself is not part of them.
template <class K, class L, int packs>
struct Column {
  const std::array<double, 3>& weights;
  NodeArray<K, packs> angular;
  NodeArray<L, packs> linear;
  ROD_INLINE auto k(int p) const { return weights[0] * angular[p]; }
  ROD_INLINE auto k1(int p) const { return weights[1] * angular[p]; }
  ROD_INLINE auto k2(int p) const { return weights[2] * angular[p]; }
  ROD_INLINE auto l(int p) const { return weights[0] * linear[p]; }
  ROD_INLINE auto l1(int p) const { return weights[1] * linear[p]; }
  ROD_INLINE auto l2(int p) const { return weights[2] * linear[p]; }
};

/// Variation of the rates at a fixed shape.
template <class K, class L, int packs>
struct Rates {
  NodeArray<K, packs> angular1, angular2;
  NodeArray<L, packs> linear1, linear2;
  ROD_INLINE ZeroVector k(int) const { return {}; }
  ROD_INLINE auto k1(int p) const { return angular1[p]; }
  ROD_INLINE auto k2(int p) const { return angular2[p]; }
  ROD_INLINE ZeroVector l(int) const { return {}; }
  ROD_INLINE auto l1(int p) const { return linear1[p]; }
  ROD_INLINE auto l2(int p) const { return linear2[p]; }
};

/// Variations of the motions of a segment at its start and end, and of the wrench at its start.
struct EndVariations {
  SectionVariation start, end;
  Wrench base;
};

/// Writes the derivative of [R^T m; R^T n] in the direction d; of a segment also those at its ends.
template <class Space, int packs, bool moving, class Variation>
ROD_INLINE void linearise(const RodConstants& rod, const Kinematics& w, const Variation& d, VectorField& couple,
                          VectorField& force, [[maybe_unused]] EndVariations* ends = nullptr) {
  using Linear = typename Space::Linear;
  using Angular = typename Space::Angular;
  const Quadrature& grid = *rod.grid;
  const auto accumulate = [&](const auto& density, double scale, Vec3 SectionVariation::*part) ROD_LAMBDA_INLINE {
    auto sum = integral(grid.forward, density);
    if constexpr (Space::segment) {
      const Vec3 start = ends->start.*part;
      ends->end.*part = start + scale * node_sum<packs>(grid, widen<packs>(density));
      auto shifted = widen<packs>(sum);
      add_to_all(shifted, (1.0 / scale) * start);
      return shifted;
    } else {
      return sum;
    }
  };
  const auto theta =
      accumulate(for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE { return d.k(p); }), 1.0, &SectionVariation::theta);
  const auto l = for_each_pack<packs>(
      [&](int p) ROD_LAMBDA_INLINE { return cross(theta[p], restrict_to<Linear>(w.l, p)) + d.l(p); });
  const auto write = [&](const auto& density, const auto& n) ROD_LAMBDA_INLINE {
    if constexpr (Space::segment) ends->base.moment = node_sum<packs>(grid, widen<packs>(density));
    const auto m = integral(grid.adjoint, density);
    for (int p = 0; p < packs; ++p) {
      const auto R = Space::rotation_at(w.R, p);
      couple.set(p, transpose_times(R, m[p] - cross(theta[p], restrict_to<Angular>(w.m, p))));
      force.set(p, transpose_times(R, n(p) - cross(theta[p], restrict_to<Linear>(w.n, p))));
    }
  };
  if constexpr (!moving) {
    write(for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE { return cross(l[p], restrict_to<Linear>(w.n, p)); }),
          [](int) ROD_LAMBDA_INLINE { return ZeroVector{}; });
  } else {
    const auto k1 = for_each_pack<packs>(
        [&](int p) ROD_LAMBDA_INLINE { return cross(theta[p], restrict_to<Angular>(w.k1, p)) + d.k1(p); });
    const auto omega = accumulate(k1, 1.0, &SectionVariation::omega);
    const auto alpha = accumulate(for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE {
                                    return cross(omega[p], restrict_to<Angular>(w.k1, p)) +
                                           cross(restrict_to<Angular>(w.omega, p), k1[p]) +
                                           cross(theta[p], restrict_to<Angular>(w.k2, p)) + d.k2(p);
                                  }),
                                  1.0, &SectionVariation::alpha);
    auto n = accumulate(for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE {
                          const auto here = restrict_to<Linear>(w.l, p);
                          const auto spin = restrict_to<Angular>(w.omega, p);
                          const auto l1 = cross(theta[p], restrict_to<Linear>(w.l1, p)) + d.l1(p);
                          const auto l2 = cross(theta[p], restrict_to<Linear>(w.l2, p)) + d.l2(p);
                          const auto swing = cross(omega[p], here) + cross(spin, l[p]) + 2.0 * l1;
                          return cross(alpha[p], here) + cross(restrict_to<Angular>(w.alpha, p), l[p]) +
                                 cross(omega[p], restrict_to<Linear>(w.swing, p)) + cross(spin, swing) + l2;
                        }),
                        rod.length, &SectionVariation::a);
    for (int p = 0; p < packs; ++p) n[p] = -section_mass<Space>(rod, p) * n[p];
    if constexpr (Space::segment) ends->base.force = (1.0 / rod.length) * node_sum<packs>(grid, widen<packs>(n));
    n = integral(grid.adjoint, n);
    write(for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE {
            const auto inertia = section_inertia<Space>(rod, p);
            const auto R = Space::rotation_at(w.R, p);
            const auto body = restrict_to<Angular>(w.omega_body, p);
            const auto d_body = transpose_times(R, omega[p] - cross(theta[p], restrict_to<Angular>(w.omega, p)));
            const auto d_alpha = transpose_times(R, alpha[p] - cross(theta[p], restrict_to<Angular>(w.alpha, p)));
            const auto d_h =
                scale(inertia, d_alpha) + cross(d_body, scale(inertia, body)) + cross(body, scale(inertia, d_body));
            return cross(l[p], restrict_to<Linear>(w.n, p)) + cross(restrict_to<Linear>(w.l, p), n[p]) -
                   cross(theta[p], restrict_to<Angular>(w.hdot, p)) - R * d_h;
          }),
          [&](int p) ROD_LAMBDA_INLINE { return n[p]; });
  }
}

}  // namespace rod
