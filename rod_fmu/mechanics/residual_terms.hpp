// Terms of the residual of the rod's balance of momentum (Eq. 8 with Eqs. 15-16), projected onto the strain
// polynomials: a chain of integrals, strains, orientation, velocities and accelerations from the clamp to the nodes,
// then force and moment from the tip back.
//   R' = R kappa^,  p' = R lambda                                              (Eq. 5)
//   omega' = R dkappa/dt,  (dp/dt)' = omega x p' + R dlambda/dt                (Eq. 6, compatibility, in the fixed
//   frame) n(s) = F + int_s^L rho A (g - d2p/dt2) ds,   m(s) = M + int_s^L (p' x n - dh/dt) ds   (Eq. 7, corrected) u_i
//   = lambda + kappa x r_i + r_i',  t_i = u_i/|u_i|                        (Eqs. 9-13, path of a TCA)
// Sources: Boyer et al., IEEE Trans. Robot. 37 (2021), and Mathew et al., IEEE Trans. Robot. 39 (2023), for rods
// parametrised by strains; integrals in the fixed frame replace their recursions on SE(3).
#pragma once

#include "mechanics/loops.hpp"
#include "mechanics/polynomials.hpp"
#include "mechanics/rotations.hpp"
#include "mechanics/space.hpp"
#include "numerics/kernel.hpp"

namespace rod {

/// Turns the orientations of a segment, which are relative to its start, into the rod's frame.
ROD_INLINE void turn_with_start(int packs, Kinematics& w) {
  const Rotation<double>& S = w.base.R;
  for (int p = 0; p < packs; ++p) {
    const Rotation<Pack> R = w.R[p];
    const auto turned = [&R](const Vec3& row)
                            ROD_LAMBDA_INLINE { return row.x * R.row0 + row.y * R.row1 + row.z * R.row2; };
    w.R.set(p, Rotation<Pack>{turned(S.row0), turned(S.row1), turned(S.row2)});
  }
  const auto [a, b, c, d] = w.base.quaternion;
  const auto [e, f, g, h] = w.tip_quaternion;
  w.tip_quaternion = {a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f,
                      a * h + b * g - c * f + d * e};
}

/// Integral of a vector over a segment, in units of its length.
template <int packs>
ROD_INLINE Vec3 node_sum(const Quadrature& grid, const NodeArray<Triad<Pack>, packs>& f) {
  Triad<Pack> sum{};
  for (int p = 0; p < packs; ++p) sum = sum + grid.w.pack[p] * f[p];
  const auto total = [](const Pack& a) ROD_LAMBDA_INLINE { return (a[0] + a[1]) + (a[2] + a[3]); };
  return {total(sum.x), total(sum.y), total(sum.z)};
}

template <std::size_t packs>
ROD_INLINE void add_to_all(NodeArray<Triad<Pack>, packs>& f, const Vec3& a) {
  for (auto& each : f) each = each + broadcast(a);
}

/// rho A L^3 [kg m2], and rho diag(I, I, 2 I) L [kg m2], at the nodes of a pack.
template <class Space>
ROD_INLINE auto section_mass(const RodConstants& rod, int p) {
  if constexpr (Space::segment)
    return (rod.length * rod.length * rod.length) * rod.inertia_along->mass.pack[p];
  else
    return rod.mass * rod.length * rod.length * rod.length;
}
template <class Space>
ROD_INLINE Triad<Pack> section_inertia(const RodConstants& rod, [[maybe_unused]] int p) {
  if constexpr (Space::segment) {
    const Pack rotary = rod.length * rod.inertia_along->rotary.pack[p];
    return {rotary, rotary, 2.0 * rotary};
  } else {
    return rod.length * broadcast(rod.inertia);
  }
}

/// Orientation from the coefficients of the curvature: a Magnus expansion in space, exact in a plane.
template <class Space, int packs>
ROD_INLINE void orientation(const RodConstants& rod, const double* q, Kinematics& w) {
  const Quadrature& grid = *rod.grid;
  if constexpr (Space::planar) {
    ScalarField angle;
    for (int p = 0; p < packs; ++p) angle.pack[p] = rod.kappa.y * grid.s.pack[p];
    add_expansion<packs>(rod, 0, q, grid.legendre_integral, angle);
    rotate_in_plane<packs>(angle, w.R);
    return;
  }
  constexpr int interval_packs = interval_packs_of(packs);
  const double reference[3] = {rod.kappa.x, rod.kappa.y, rod.kappa.z};
  IntervalCurvature kappa;
  for (int g = 0; g < kGaussPoints; ++g)
    for (int c = 0; c < 3; ++c)
      for (int p = 0; p < interval_packs; ++p) kappa[g][c].pack[p] = Pack{} + reference[c];
  for (int i = 0; i < rod.count; ++i) {
    const int c = rod.components[i];
    if (c > 2) continue;
    for (int g = 0; g < kGaussPoints; ++g)
      for (int p = 0; p < interval_packs; ++p) {
        Pack sum = kappa[g][c].pack[p];
        for (int a = 0; a < rod.terms; ++a) sum += q[a * rod.count + i] * grid.legendre_at_gauss_points[a][g].pack[p];
        kappa[g][c].pack[p] = sum;
      }
  }
  w.tip_quaternion = rotate_along(grid, kappa, w.R);
  if constexpr (Space::segment) turn_with_start(packs, w);
}

/// Length, direction and arm of u_i = lambda + kappa x r_i + r_i', and the gradient of its path (Eqs. 9-13, Eq. 17).
template <class Space, int packs>
ROD_INLINE void tca_geometry(const RodConstants& rod, const VectorField& kappa, const VectorField& lambda,
                             Kinematics& w, const Gradients& b) {
  for (std::size_t i = 0; i < rod.tcas; ++i) {
    if constexpr (Space::segment)
      if (!rod.is_routed[i]) continue;
    ScalarField length;
    for (int p = 0; p < packs; ++p) {
      const auto r = restrict_to<InSection>(rod.offset[i], p);
      const auto u = restrict_to<typename Space::Linear>(lambda, p) +
                     cross(restrict_to<typename Space::Angular>(kappa, p), r) + restrict_to<InSection>(rod.slope[i], p);
      length.pack[p] = square_root(dot(u, u));
      const Pack inverse = 1.0 / length.pack[p];
      w.inverse_length[i].pack[p] = inverse;
      w.t[i].set(p, inverse * u);
      w.arm[i].set(p, cross(r, inverse * u));
    }
    w.path[i] = weighted_sum<packs>(rod.grid->w, length);
    project<packs>(rod, w.arm[i], w.t[i], rod.length, b[i]);
  }
}

/// Angular velocity, and velocity over L.
template <class Space, int packs>
ROD_INLINE void velocities(const RodConstants& rod, const double* v, Kinematics& w) {
  using Linear = typename Space::Linear;
  using Angular = typename Space::Angular;
  const Quadrature& grid = *rod.grid;
  VectorField kappa1, lambda1;
  add_expansion<packs>(rod, v, kappa1, lambda1);
  NodeArray<Angular, packs> omega;
  for (int p = 0; p < packs; ++p) {
    const auto R = Space::rotation_at(w.R, p);
    omega[p] = R * restrict_to<Angular>(kappa1, p);
    w.k1.set(p, omega[p]);
    w.l1.set(p, R * restrict_to<Linear>(lambda1, p));
  }
  if constexpr (Space::segment) w.tip.omega = w.base.omega + node_sum<packs>(grid, omega);
  omega = integral(grid.forward, omega);
  if constexpr (Space::segment) add_to_all(omega, w.base.omega);
  NodeArray<Linear, packs> velocity;
  for (int p = 0; p < packs; ++p) {
    velocity[p] = cross(omega[p], restrict_to<Linear>(w.l, p)) + restrict_to<Linear>(w.l1, p);
    w.omega.set(p, omega[p]), w.omega_body.set(p, transpose_times(Space::rotation_at(w.R, p), omega[p]));
  }
  if constexpr (Space::segment) w.tip.v = w.base.v + rod.length * node_sum<packs>(grid, velocity);
  velocity = integral(grid.forward, velocity);
  if constexpr (Space::segment) add_to_all(velocity, (1.0 / rod.length) * w.base.v);
  for (int p = 0; p < packs; ++p) w.velocity.set(p, velocity[p]);
}

/// Inertia force per length and rate of angular momentum; needs velocities() of the same state.
template <class Space, int packs>
ROD_INLINE void inertia_forces(const RodConstants& rod, const double* a, Kinematics& w,
                               NodeArray<typename Space::Linear, packs>& n,
                               NodeArray<typename Space::Angular, packs>& hdot) {
  using Linear = typename Space::Linear;
  using Angular = typename Space::Angular;
  const Quadrature& grid = *rod.grid;
  VectorField kappa2, lambda2;
  add_expansion<packs>(rod, a, kappa2, lambda2);
  NodeArray<Angular, packs> alpha;
  for (int p = 0; p < packs; ++p) {
    const auto R = Space::rotation_at(w.R, p);
    w.k2.set(p, R * restrict_to<Angular>(kappa2, p));
    w.l2.set(p, R * restrict_to<Linear>(lambda2, p));
    alpha[p] = cross(restrict_to<Angular>(w.omega, p), restrict_to<Angular>(w.k1, p)) + restrict_to<Angular>(w.k2, p);
  }
  if constexpr (Space::segment) w.tip.alpha = w.base.alpha + node_sum<packs>(grid, alpha);
  alpha = integral(grid.forward, alpha);
  if constexpr (Space::segment) add_to_all(alpha, w.base.alpha);
  NodeArray<Linear, packs> acceleration;
  for (int p = 0; p < packs; ++p) {
    const auto inertia = section_inertia<Space>(rod, p);
    const auto R = Space::rotation_at(w.R, p);
    const auto l = restrict_to<Linear>(w.l, p), l1 = restrict_to<Linear>(w.l1, p);
    const auto omega = restrict_to<Angular>(w.omega, p), body = restrict_to<Angular>(w.omega_body, p);
    const auto swing = cross(omega, l) + 2.0 * l1;
    acceleration[p] = cross(alpha[p], l) + cross(omega, swing) + restrict_to<Linear>(w.l2, p);
    hdot[p] = R * (scale(inertia, transpose_times(R, alpha[p])) + cross(body, scale(inertia, body)));
    w.alpha.set(p, alpha[p]), w.swing.set(p, swing), w.hdot.set(p, hdot[p]);
  }
  if constexpr (Space::segment) w.tip.a = w.base.a + rod.length * node_sum<packs>(grid, acceleration);
  acceleration = integral(grid.forward, acceleration);
  if constexpr (Space::segment) add_to_all(acceleration, (1.0 / rod.length) * w.base.a);
  for (int p = 0; p < packs; ++p) n[p] = -section_mass<Space>(rod, p) * acceleration[p];
}

/// The strains at the nodes.
template <int packs>
ROD_INLINE void strains(const RodConstants& rod, const double* q, VectorField& kappa, VectorField& lambda) {
  for (int p = 0; p < packs; ++p) kappa.set(p, broadcast(rod.kappa)), lambda.set(p, broadcast(rod.lambda));
  add_expansion<packs>(rod, q, kappa, lambda);
}

/// Orientation, tangent and TCA paths.
template <class Space, int packs>
ROD_INLINE void positions(const RodConstants& rod, const double* q, Kinematics& w, const Gradients& b) {
  VectorField kappa, lambda;
  strains<packs>(rod, q, kappa, lambda);
  orientation<Space, packs>(rod, q, w);
  tca_geometry<Space, packs>(rod, kappa, lambda, w, b);
  for (int p = 0; p < packs; ++p)
    w.l.set(p, Space::rotation_at(w.R, p) * restrict_to<typename Space::Linear>(lambda, p));
}

/// Force and moment from the tip back, and their projection. On entry n holds the inertia force, integrated from the
/// tip, and m the rate of angular momentum.
template <class Space, int packs>
ROD_INLINE void balance(const RodConstants& rod, const BodyLoads& loads, NodeArray<typename Space::Linear, packs>& n,
                        NodeArray<typename Space::Angular, packs>& m, Kinematics& w, double* r) {
  using Linear = typename Space::Linear;
  using Angular = typename Space::Angular;
  const Quadrature& grid = *rod.grid;
  const Vec3 weight = (rod.mass * rod.length * rod.length) * loads.gravity;
  for (int p = 0; p < packs; ++p) {
    n[p] = n[p] + (restrict_to<Linear>(broadcast(rod.length * loads.tip_force)) +
                   (1.0 - grid.s.pack[p]) * restrict_to<Linear>(broadcast(weight)));
    m[p] = cross(restrict_to<Linear>(w.l, p), n[p]) - m[p];
    w.n.set(p, n[p]);
  }
  m = integral(grid.adjoint, m);
  VectorField couple, force;
  for (int p = 0; p < packs; ++p) {
    const auto R = Space::rotation_at(w.R, p);
    m[p] = m[p] + restrict_to<Angular>(broadcast(loads.tip_moment));
    w.m.set(p, m[p]);
    couple.set(p, transpose_times(R, m[p]));
    force.set(p, transpose_times(R, n[p]));
  }
  project<packs>(rod, couple, force, -1.0, r);
}

}  // namespace rod
