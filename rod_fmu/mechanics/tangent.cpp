// Exact derivatives of the residual: its chain of integrals, linearised. A variation of the strains turns every section
// by dtheta(s) = int_0^s R dkappa ds and changes p' by dtheta x p' + R dlambda; the rest follows from the product rule.
// Parts of a variation that vanish (shear does not rotate a section, rates do not change the shape) have the type Zero
// and cost nothing.
#include "mechanics/loops.hpp"
#include "mechanics/polynomials.hpp"
#include "mechanics/space.hpp"
#include "numerics/kernel.hpp"

namespace rod {

namespace {

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

/// Writes the derivative of [R^T m; R^T n] in the direction d.
template <class Space, int packs, bool moving, class Variation>
ROD_INLINE void linearise(const RodConstants& rod, const Kinematics& w, const Variation& d, VectorField& couple,
                          VectorField& force) {
  using Linear = Space::Linear;
  using Angular = Space::Angular;
  const Quadrature& grid = *rod.grid;
  const auto theta = integral(grid.forward, for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE { return d.k(p); }));
  const auto l = for_each_pack<packs>(
      [&](int p) ROD_LAMBDA_INLINE { return cross(theta[p], restrict_to<Linear>(w.l, p)) + d.l(p); });
  const auto write = [&](const auto& density, const auto& n) ROD_LAMBDA_INLINE {
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
    const auto omega = integral(grid.forward, k1);
    const auto alpha = integral(grid.forward, for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE {
                                  return cross(omega[p], restrict_to<Angular>(w.k1, p)) +
                                         cross(restrict_to<Angular>(w.omega, p), k1[p]) +
                                         cross(theta[p], restrict_to<Angular>(w.k2, p)) + d.k2(p);
                                }));
    const double mass = rod.mass * rod.length * rod.length * rod.length;
    auto n = integral(grid.forward, for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE {
                        const auto here = restrict_to<Linear>(w.l, p);
                        const auto spin = restrict_to<Angular>(w.omega, p);
                        const auto l1 = cross(theta[p], restrict_to<Linear>(w.l1, p)) + d.l1(p);
                        const auto l2 = cross(theta[p], restrict_to<Linear>(w.l2, p)) + d.l2(p);
                        const auto swing = cross(omega[p], here) + cross(spin, l[p]) + 2.0 * l1;
                        return cross(alpha[p], here) + cross(restrict_to<Angular>(w.alpha, p), l[p]) +
                               cross(omega[p], restrict_to<Linear>(w.swing, p)) + cross(spin, swing) + l2;
                      }));
    n = integral(grid.adjoint, for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE { return -mass * n[p]; }));
    const auto inertia = rod.length * broadcast(rod.inertia);
    write(for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE {
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

/// Derivative of sum N_i [r_i x t_i; t_i] L in strain component c at constant tensions: dt = (1 - t t^T) du/|u|, the
/// force follows the direction of the TCA.
template <class Space, int packs>
ROD_INLINE void linearise_tca_direction(const RodConstants& rod, const Kinematics& w, int c, double weight,
                                        const PerTca<double>& tension, VectorField& couple, VectorField& force) {
  std::array<double, 6> unit{};
  unit[c] = 1.0;
  const Vec3 bend{unit[0], unit[1], unit[2]}, shift{unit[3], unit[4], unit[5]};
  for (std::size_t i = 0; i < kTcas; ++i) {
    if (tension[i] == 0.0) continue;
    for (int p = 0; p < packs; ++p) {
      const auto r = restrict_to<InSection>(rod.offset[i], p);
      const auto t = w.t[i][p];
      const auto du = broadcast(shift) + cross(broadcast(bend), r);
      const Pack factor = (weight * rod.length * tension[i]) * w.inverse_length[i].pack[p];
      const auto dt = factor * (du - dot(t, du) * t);
      couple.set(p, couple[p] + cross(r, dt));
      force.set(p, force[p] + dt);
    }
  }
}

template <class Space, int packs, bool moving>
ROD_INLINE void columns(const RodConstants& rod, const Kinematics& w, const std::array<double, 3>& weights,
                        const PerTca<double>& tension, double* J) {
  using Linear = Space::Linear;
  using Angular = Space::Angular;
  const Quadrature& grid = *rod.grid;
  const int unknowns = rod.unknowns();
  for (int i = 0; i < rod.count; ++i) {
    const int c = rod.components[i];
    const ScalarField &x = component(w.R.row0, c % 3), &y = component(w.R.row1, c % 3), &z = component(w.R.row2, c % 3);
    VectorField couple_per, force_per;
    linearise_tca_direction<Space, packs>(rod, w, c, weights[0], tension, couple_per, force_per);
    for (int a = 0; a < rod.terms; ++a) {
      const ScalarField& shape = grid.legendre[a];
      const auto carried = [&](int p) ROD_LAMBDA_INLINE {
        return shape.pack[p] * Triad<Pack>{x.pack[p], y.pack[p], z.pack[p]};
      };
      VectorField couple, force;
      if (c < 3)
        linearise<Space, packs, moving>(
            rod, w,
            Column<Angular, ZeroVector, packs>{
                weights,
                for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE { return restrict_to<Angular>(carried(p)); }),
                {}},
            couple, force);
      else
        linearise<Space, packs, moving>(
            rod, w, Column<ZeroVector, Linear, packs>{weights, {}, for_each_pack<packs>([&](int p) ROD_LAMBDA_INLINE {
                                                        return restrict_to<Linear>(carried(p));
                                                      })},
            couple, force);
      for (int p = 0; p < packs; ++p) {
        couple.set(p, couple[p] - shape.pack[p] * couple_per[p]);
        force.set(p, force[p] - shape.pack[p] * force_per[p]);
      }
      project<packs>(rod, couple, force, -1.0, J + (a * rod.count + i) * unknowns);
    }
  }
}

template <class Space, int packs>
ROD_INLINE void tangent(const RodConstants& rod, const Kinematics& w, const std::array<double, 3>& weights,
                        const PerTca<double>& tension, double* J) {
  if (w.moving)
    columns<Space, packs, true>(rod, w, weights, tension, J);
  else
    columns<Space, packs, false>(rod, w, weights, tension, J);
}

template <class Space, int packs>
ROD_INLINE void rates(const RodConstants& rod, const Kinematics& w, const double* dv, const double* da, double* dr) {
  using Linear = Space::Linear;
  using Angular = Space::Angular;
  VectorField kappa1, lambda1, kappa2, lambda2;
  add_expansion<packs>(rod, dv, kappa1, lambda1);
  add_expansion<packs>(rod, da, kappa2, lambda2);
  Rates<Angular, Linear, packs> d;
  for (int p = 0; p < packs; ++p) {
    const auto R = Space::rotation_at(w.R, p);
    d.angular1[p] = R * restrict_to<Angular>(kappa1, p);
    d.angular2[p] = R * restrict_to<Angular>(kappa2, p);
    d.linear1[p] = R * restrict_to<Linear>(lambda1, p);
    d.linear2[p] = R * restrict_to<Linear>(lambda2, p);
  }
  VectorField couple, force;
  linearise<Space, packs, true>(rod, w, d, couple, force);
  project<packs>(rod, couple, force, -1.0, dr);
}

struct Tangent {
  template <class Space, int packs>
  static TangentLoops of() {
    return {.tangent = dispatch<tangent<Space, packs>>, .rate = dispatch<rates<Space, packs>>};
  }
};

}  // namespace

TangentLoops tangent_loops(const RodConstants& rod) { return select_loop<Tangent>(rod); }

}  // namespace rod
