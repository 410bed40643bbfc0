// The residual's chain of integrals: strains, orientation, velocities and accelerations from the clamp to the nodes,
// force and moment from the tip back. Sources: Boyer et al. (2021) and Mathew et al. (2023) for strain-parametrised
// rods; the integrals in the fixed frame (omega' = R kappa., p.' = omega x p' + R lambda.) replace their recursions on
// SE(3).
#include "mechanics/loops.hpp"
#include "mechanics/polynomials.hpp"
#include "mechanics/rotations.hpp"
#include "mechanics/space.hpp"
#include "numerics/kernel.hpp"

namespace rod {

namespace {

/// Orientation from the coefficients of the curvature: a Magnus expansion in space, exact in a plane.
template <class Space, int packs>
ROD_INLINE void orientation(const Build& build, const double* q, Kinematics& w) {
  const Quadrature& grid = *build.grid;
  if constexpr (Space::planar) {
    Lane angle;
    for (int p = 0; p < packs; ++p) angle.pack[p] = build.kappa.y * grid.s.pack[p];
    expand<packs>(build, 0, q, grid.turned, angle);
    rotate_in_plane<packs>(angle, w.R);
    return;
  }
  constexpr int interval_packs = interval_packs_of(packs);
  const double reference[3] = {build.kappa.x, build.kappa.y, build.kappa.z};
  IntervalCurvature kappa;
  for (int g = 0; g < points; ++g)
    for (int c = 0; c < 3; ++c)
      for (int p = 0; p < interval_packs; ++p) kappa[g][c].pack[p] = Pack{} + reference[c];
  for (int i = 0; i < build.count; ++i) {
    const int c = build.components[i];
    if (c > 2) continue;
    for (int g = 0; g < points; ++g)
      for (int p = 0; p < interval_packs; ++p) {
        Pack sum = kappa[g][c].pack[p];
        for (int a = 0; a < build.terms; ++a) sum += q[a * build.count + i] * grid.legendre_between[a][g].pack[p];
        kappa[g][c].pack[p] = sum;
      }
  }
  w.tip_quaternion = rotate_along(grid, kappa, w.R);
}

/// u_i = lambda + kappa x r_i + r_i', its length (the integrand of delta_i, Eq. 17), direction and arm.
template <class Space, int packs>
ROD_INLINE void tca_geometry(const Build& build, const Field& kappa, const Field& lambda, Kinematics& w,
                             const std::array<double*, tca_count>& b) {
  for (std::size_t i = 0; i < tca_count; ++i) {
    Lane length;
    for (int p = 0; p < packs; ++p) {
      const auto r = take<InSection>(build.offset[i], p);
      const auto u = take<typename Space::Linear>(lambda, p) + cross(take<typename Space::Angular>(kappa, p), r) +
                     take<InSection>(build.slope[i], p);
      length.pack[p] = root(dot(u, u));
      const Pack inverse = 1.0 / length.pack[p];
      w.inverse_length[i].pack[p] = inverse;
      w.t[i].set(p, inverse * u);
      w.arm[i].set(p, cross(r, inverse * u));
    }
    w.path[i] = total<packs>(build.grid->w, length);
    moments<packs>(build, w.arm[i], w.t[i], build.length, b[i]);
  }
}

/// omega and the velocity [p. over L].
template <class Space, int packs>
ROD_INLINE void velocities(const Build& build, const double* v, Kinematics& w) {
  using Linear = Space::Linear;
  using Angular = Space::Angular;
  const Quadrature& grid = *build.grid;
  Field kappa1, lambda1;
  expand<packs>(build, v, kappa1, lambda1);
  Along<Angular, packs> omega;
  for (int p = 0; p < packs; ++p) {
    const auto R = Space::turn(w.R, p);
    omega[p] = R * take<Angular>(kappa1, p);
    w.k1.set(p, omega[p]);
    w.l1.set(p, R * take<Linear>(lambda1, p));
  }
  omega = integral(grid.forward, omega);
  Along<Linear, packs> velocity;
  for (int p = 0; p < packs; ++p) {
    velocity[p] = cross(omega[p], take<Linear>(w.l, p)) + take<Linear>(w.l1, p);
    w.omega.set(p, omega[p]), w.omega_body.set(p, back(Space::turn(w.R, p), omega[p]));
  }
  velocity = integral(grid.forward, velocity);
  for (int p = 0; p < packs; ++p) w.velocity.set(p, velocity[p]);
}

/// Force from the acceleration [p..' over L], behind velocities().
template <class Space, int packs>
ROD_INLINE void inertia_forces(const Build& build, const double* a, Kinematics& w,
                               Along<typename Space::Linear, packs>& n, Along<typename Space::Angular, packs>& hdot) {
  using Linear = Space::Linear;
  using Angular = Space::Angular;
  const Quadrature& grid = *build.grid;
  Field kappa2, lambda2;
  expand<packs>(build, a, kappa2, lambda2);
  Along<Angular, packs> alpha;
  for (int p = 0; p < packs; ++p) {
    const auto R = Space::turn(w.R, p);
    w.k2.set(p, R * take<Angular>(kappa2, p));
    w.l2.set(p, R * take<Linear>(lambda2, p));
    alpha[p] = cross(take<Angular>(w.omega, p), take<Angular>(w.k1, p)) + take<Angular>(w.k2, p);
  }
  alpha = integral(grid.forward, alpha);
  Along<Linear, packs> acceleration;
  const auto inertia = build.length * spread(build.inertia);
  for (int p = 0; p < packs; ++p) {
    const auto R = Space::turn(w.R, p);
    const auto l = take<Linear>(w.l, p), l1 = take<Linear>(w.l1, p);
    const auto omega = take<Angular>(w.omega, p), body = take<Angular>(w.omega_body, p);
    const auto swing = cross(omega, l) + 2.0 * l1;
    acceleration[p] = cross(alpha[p], l) + cross(omega, swing) + take<Linear>(w.l2, p);
    hdot[p] = R * (scale(inertia, back(R, alpha[p])) + cross(body, scale(inertia, body)));
    w.alpha.set(p, alpha[p]), w.swing.set(p, swing), w.hdot.set(p, hdot[p]);
  }
  acceleration = integral(grid.forward, acceleration);
  const double mass = build.mass * build.length * build.length * build.length;
  for (int p = 0; p < packs; ++p) n[p] = -mass * acceleration[p];
}

template <class Space, int packs>
ROD_INLINE void residual(const Build& build, const double* q, const double* v, const double* a, const Loads& loads,
                         Kinematics& w, double* r, const std::array<double*, tca_count>& b) {
  using Linear = Space::Linear;
  using Angular = Space::Angular;
  const Quadrature& grid = *build.grid;
  Field kappa, lambda;
  for (int p = 0; p < packs; ++p) kappa.set(p, spread(build.kappa)), lambda.set(p, spread(build.lambda));
  expand<packs>(build, q, kappa, lambda);
  orientation<Space, packs>(build, q, w);
  tca_geometry<Space, packs>(build, kappa, lambda, w, b);
  for (int p = 0; p < packs; ++p) w.l.set(p, Space::turn(w.R, p) * take<Linear>(lambda, p));

  w.moving = v != nullptr;
  if (w.moving) velocities<Space, packs>(build, v, w);
  if (!r) return;
  // Force: what is at the tip, weight, and inertia; the last two from the tip to the node.
  Along<Linear, packs> n{};
  Along<Angular, packs> m{};
  if (w.moving) {
    inertia_forces<Space, packs>(build, a, w, n, m);
    n = integral(grid.adjoint, n);
  }
  const Vec3 weight = (build.mass * build.length * build.length) * loads.gravity;
  for (int p = 0; p < packs; ++p) {
    n[p] = n[p] + (take<Linear>(spread(build.length * loads.tip_force)) +
                   (1.0 - grid.s.pack[p]) * take<Linear>(spread(weight)));
    m[p] = cross(take<Linear>(w.l, p), n[p]) - m[p];
    w.n.set(p, n[p]);
  }
  m = integral(grid.adjoint, m);
  Field couple, force;
  for (int p = 0; p < packs; ++p) {
    const auto R = Space::turn(w.R, p);
    m[p] = m[p] + take<Angular>(spread(loads.tip_moment));
    w.m.set(p, m[p]);
    couple.set(p, back(R, m[p]));
    force.set(p, back(R, n[p]));
  }
  moments<packs>(build, couple, force, -1.0, r);
}

struct Residual {
  template <class Space, int packs>
  static ResidualLoop of() {
    return fastest<residual<Space, packs>>;
  }
};

}  // namespace

ResidualLoop residual_loop(const Build& build) { return choose<Residual>(build); }

}  // namespace rod
