// Exact derivatives of the residual: its chain of integrals, varied. A variation of the strains turns every section by
// dtheta(s) = int_0^s R dkappa and changes p' by dtheta x p' + R dlambda; all else follows by the product rule. What a
// variation lacks (a shear does not turn, a rate leaves the shape alone) has the type Zero.
#include "mechanics/loops.hpp"
#include "mechanics/polynomials.hpp"
#include "mechanics/space.hpp"
#include "numerics/kernel.hpp"

namespace rod {

namespace {

using Nothing = Triad<Zero>;

/// f at every pack.
template <int packs, class F>
ROD_INLINE auto along(const F& f) {
  Along<decltype(f(0)), packs> out;
  for (int p = 0; p < packs; ++p) out[p] = f(p);
  return out;
}

/// Variations in the fixed frame, turns of the section apart: R dkappa L and R dlambda and those of their rates. One
/// coefficient: degree times a direction that the section carries along.
template <class K, class L, int packs>
struct Column {
  const std::array<double, 3>& weights;
  Along<K, packs> angular;
  Along<L, packs> linear;
  ROD_INLINE auto k(int p) const { return weights[0] * angular[p]; }
  ROD_INLINE auto k1(int p) const { return weights[1] * angular[p]; }
  ROD_INLINE auto k2(int p) const { return weights[2] * angular[p]; }
  ROD_INLINE auto l(int p) const { return weights[0] * linear[p]; }
  ROD_INLINE auto l1(int p) const { return weights[1] * linear[p]; }
  ROD_INLINE auto l2(int p) const { return weights[2] * linear[p]; }
};

/// Any rates, at a fixed shape.
template <class K, class L, int packs>
struct Rates {
  Along<K, packs> angular1, angular2;
  Along<L, packs> linear1, linear2;
  ROD_INLINE Nothing k(int) const { return {}; }
  ROD_INLINE auto k1(int p) const { return angular1[p]; }
  ROD_INLINE auto k2(int p) const { return angular2[p]; }
  ROD_INLINE Nothing l(int) const { return {}; }
  ROD_INLINE auto l1(int p) const { return linear1[p]; }
  ROD_INLINE auto l2(int p) const { return linear2[p]; }
};

/// Writes the variation of [R^T m; R^T n].
template <class Space, int packs, bool moving, class Variation>
ROD_INLINE void vary(const Build& build, const Kinematics& w, const Variation& d, Field& couple, Field& force) {
  using Linear = Space::Linear;
  using Angular = Space::Angular;
  const Quadrature& grid = *build.grid;
  const auto theta = integral(grid.forward, along<packs>([&](int p) ROD_LAMBDA_INLINE { return d.k(p); }));
  const auto l = along<packs>([&](int p) ROD_LAMBDA_INLINE { return cross(theta[p], take<Linear>(w.l, p)) + d.l(p); });
  const auto write = [&](const auto& density, const auto& n) ROD_LAMBDA_INLINE {
    const auto m = integral(grid.adjoint, density);
    for (int p = 0; p < packs; ++p) {
      const auto R = Space::turn(w.R, p);
      couple.set(p, back(R, m[p] - cross(theta[p], take<Angular>(w.m, p))));
      force.set(p, back(R, n(p) - cross(theta[p], take<Linear>(w.n, p))));
    }
  };
  if constexpr (!moving) {
    write(along<packs>([&](int p) ROD_LAMBDA_INLINE { return cross(l[p], take<Linear>(w.n, p)); }),
          [](int) ROD_LAMBDA_INLINE { return Nothing{}; });
  } else {
    const auto k1 =
        along<packs>([&](int p) ROD_LAMBDA_INLINE { return cross(theta[p], take<Angular>(w.k1, p)) + d.k1(p); });
    const auto omega = integral(grid.forward, k1);
    const auto alpha = integral(grid.forward, along<packs>([&](int p) ROD_LAMBDA_INLINE {
                                  return cross(omega[p], take<Angular>(w.k1, p)) +
                                         cross(take<Angular>(w.omega, p), k1[p]) +
                                         cross(theta[p], take<Angular>(w.k2, p)) + d.k2(p);
                                }));
    const double mass = build.mass * build.length * build.length * build.length;
    auto n = integral(grid.forward, along<packs>([&](int p) ROD_LAMBDA_INLINE {
                        const auto here = take<Linear>(w.l, p);
                        const auto turning = take<Angular>(w.omega, p);
                        const auto l1 = cross(theta[p], take<Linear>(w.l1, p)) + d.l1(p);
                        const auto l2 = cross(theta[p], take<Linear>(w.l2, p)) + d.l2(p);
                        const auto swing = cross(omega[p], here) + cross(turning, l[p]) + 2.0 * l1;
                        return cross(alpha[p], here) + cross(take<Angular>(w.alpha, p), l[p]) +
                               cross(omega[p], take<Linear>(w.swing, p)) + cross(turning, swing) + l2;
                      }));
    n = integral(grid.adjoint, along<packs>([&](int p) ROD_LAMBDA_INLINE { return -mass * n[p]; }));
    const auto inertia = build.length * spread(build.inertia);
    write(along<packs>([&](int p) ROD_LAMBDA_INLINE {
            const auto R = Space::turn(w.R, p);
            const auto body = take<Angular>(w.omega_body, p);
            const auto d_body = back(R, omega[p] - cross(theta[p], take<Angular>(w.omega, p)));
            const auto d_alpha = back(R, alpha[p] - cross(theta[p], take<Angular>(w.alpha, p)));
            const auto d_h =
                scale(inertia, d_alpha) + cross(d_body, scale(inertia, body)) + cross(body, scale(inertia, d_body));
            return cross(l[p], take<Linear>(w.n, p)) + cross(take<Linear>(w.l, p), n[p]) -
                   cross(theta[p], take<Angular>(w.hdot, p)) - R * d_h;
          }),
          [&](int p) ROD_LAMBDA_INLINE { return n[p]; });
  }
}

/// What strain component c does to N [r x t; t] L, summed over the TCAs: dt = (1 - t t^T) du/|u|, a pull keeps its size
/// but follows the TCA's direction.
template <class Space, int packs>
ROD_INLINE void follow(const Build& build, const Kinematics& w, int c, double weight, const PerTca<double>& pull,
                       Field& couple, Field& force) {
  Vec3 bend, shift;
  (c % 3 == 0 ? c < 3 ? bend.x : shift.x : c % 3 == 1 ? c < 3 ? bend.y : shift.y : c < 3 ? bend.z : shift.z) = 1.0;
  for (std::size_t i = 0; i < tca_count; ++i) {
    if (pull[i] == 0.0) continue;
    for (int p = 0; p < packs; ++p) {
      const auto r = take<InSection>(build.offset[i], p);
      const auto t = w.t[i][p];
      const auto du = spread(shift) + cross(spread(bend), r);
      const Pack factor = (weight * build.length * pull[i]) * w.inverse_length[i].pack[p];
      const auto dt = factor * (du - dot(t, du) * t);
      couple.set(p, couple[p] + cross(r, dt));
      force.set(p, force[p] + dt);
    }
  }
}

template <class Space, int packs, bool moving>
ROD_INLINE void columns(const Build& build, const Kinematics& w, const std::array<double, 3>& weights,
                        const PerTca<double>& pull, double* J) {
  using Linear = Space::Linear;
  using Angular = Space::Angular;
  const Quadrature& grid = *build.grid;
  const int unknowns = build.unknowns();
  for (int i = 0; i < build.count; ++i) {
    const int c = build.components[i];
    const Lane &x = lane(w.R.row0, c % 3), &y = lane(w.R.row1, c % 3), &z = lane(w.R.row2, c % 3);
    Field couple_per, force_per;
    follow<Space, packs>(build, w, c, weights[0], pull, couple_per, force_per);
    for (int a = 0; a < build.terms; ++a) {
      const Lane& shape = grid.legendre[a];
      const auto carried = [&](int p) ROD_LAMBDA_INLINE {
        return shape.pack[p] * Triad<Pack>{x.pack[p], y.pack[p], z.pack[p]};
      };
      Field couple, force;
      if (c < 3)
        vary<Space, packs, moving>(
            build, w,
            Column<Angular, Nothing, packs>{
                weights, along<packs>([&](int p) ROD_LAMBDA_INLINE { return take<Angular>(carried(p)); }), {}},
            couple, force);
      else
        vary<Space, packs, moving>(
            build, w, Column<Nothing, Linear, packs>{weights, {}, along<packs>([&](int p) ROD_LAMBDA_INLINE {
                                                       return take<Linear>(carried(p));
                                                     })},
            couple, force);
      for (int p = 0; p < packs; ++p) {
        couple.set(p, couple[p] - shape.pack[p] * couple_per[p]);
        force.set(p, force[p] - shape.pack[p] * force_per[p]);
      }
      moments<packs>(build, couple, force, -1.0, J + (a * build.count + i) * unknowns);
    }
  }
}

template <class Space, int packs>
ROD_INLINE void tangent(const Build& build, const Kinematics& w, const std::array<double, 3>& weights,
                        const PerTca<double>& pull, double* J) {
  if (w.moving)
    columns<Space, packs, true>(build, w, weights, pull, J);
  else
    columns<Space, packs, false>(build, w, weights, pull, J);
}

template <class Space, int packs>
ROD_INLINE void rates(const Build& build, const Kinematics& w, const double* dv, const double* da, double* dr) {
  using Linear = Space::Linear;
  using Angular = Space::Angular;
  Field kappa1, lambda1, kappa2, lambda2;
  expand<packs>(build, dv, kappa1, lambda1);
  expand<packs>(build, da, kappa2, lambda2);
  Rates<Angular, Linear, packs> d;
  for (int p = 0; p < packs; ++p) {
    const auto R = Space::turn(w.R, p);
    d.angular1[p] = R * take<Angular>(kappa1, p);
    d.angular2[p] = R * take<Angular>(kappa2, p);
    d.linear1[p] = R * take<Linear>(lambda1, p);
    d.linear2[p] = R * take<Linear>(lambda2, p);
  }
  Field couple, force;
  vary<Space, packs, true>(build, w, d, couple, force);
  moments<packs>(build, couple, force, -1.0, dr);
}

struct Tangent {
  template <class Space, int packs>
  static TangentLoop of() {
    return fastest<tangent<Space, packs>>;
  }
};

struct RateDerivative {
  template <class Space, int packs>
  static RateLoop of() {
    return fastest<rates<Space, packs>>;
  }
};

}  // namespace

TangentLoop tangent_loop(const Build& build) { return choose<Tangent>(build); }
RateLoop rate_loop(const Build& build) { return choose<RateDerivative>(build); }

}  // namespace rod
