// Exact derivatives of the residual: the residual's chain of integrals, varied. A variation of the strains turns every
// section by dtheta(s) = int_0^s R dkappa and changes p' by dtheta x p' + R dlambda; all else follows by the product
// rule.
#include <Eigen/Core>

#include "kernel.hpp"
#include "rod.hpp"

namespace rod {

namespace {

struct StrainVariation {
  const Field &kappa, &lambda, &kappa1, &lambda1, &kappa2, &lambda2;
};

/// Writes the variation of [R^T m; R^T n]. `angular`: the variation contains curvatures (or their rates).
template <bool moving, bool angular>
ROD_INLINE void vary_loads(const Quadrature& grid, const Work& w, const StrainVariation& d, double mass_length_3,
                           const Vec3& inertia, Field& couple, Field& force) {
  Field theta, omega, alpha, l, n, m;
  if constexpr (angular) {
    for (int p = 0; p < packs; ++p) theta.set(p, w.R[p] * d.kappa[p]);
    integrate(grid.forward, theta, theta);
  }
  for (int p = 0; p < packs; ++p) l.set(p, cross(theta[p], w.l[p]) + w.R[p] * d.lambda[p]);

  if constexpr (moving) {
    if constexpr (angular) {
      Field k1;
      for (int p = 0; p < packs; ++p) k1.set(p, cross(theta[p], w.k1[p]) + w.R[p] * d.kappa1[p]);
      integrate(grid.forward, k1, omega);
      for (int p = 0; p < packs; ++p)
        alpha.set(
            p, cross(omega[p], w.k1[p]) + cross(w.omega[p], k1[p]) + cross(theta[p], w.k2[p]) + w.R[p] * d.kappa2[p]);
      integrate(grid.forward, alpha, alpha);
    }
    for (int p = 0; p < packs; ++p) {
      const Rotation<Pack> R = w.R[p];
      const Triad<Pack> l1 = cross(theta[p], w.l1[p]) + R * d.lambda1[p];
      const Triad<Pack> l2 = cross(theta[p], w.l2[p]) + R * d.lambda2[p];
      const Triad<Pack> swing = cross(w.omega[p], w.l[p]) + 2.0 * w.l1[p];
      const Triad<Pack> d_swing = cross(omega[p], w.l[p]) + cross(w.omega[p], l[p]) + 2.0 * l1;
      n.set(p, cross(alpha[p], w.l[p]) + cross(w.alpha[p], l[p]) + cross(omega[p], swing) + cross(w.omega[p], d_swing) +
                   l2);
    }
    integrate(grid.forward, n, n);
    for (int p = 0; p < packs; ++p) n.set(p, -mass_length_3 * n[p]);
    integrate(grid.adjoint, n, n);
  }

  for (int p = 0; p < packs; ++p) {
    Triad<Pack> couple_density = cross(l[p], w.n[p]);
    if constexpr (moving) {
      couple_density = couple_density + cross(w.l[p], n[p]);
      if constexpr (angular) {
        const Rotation<Pack> R = w.R[p];
        const Triad<Pack> body = w.omega_body[p];
        const Triad<Pack> d_body = back(R, omega[p] - cross(theta[p], w.omega[p]));
        const Triad<Pack> d_alpha = back(R, alpha[p] - cross(theta[p], w.alpha[p]));
        const Triad<Pack> d_h = scale(spread(inertia), d_alpha) + cross(d_body, scale(spread(inertia), body)) +
                                cross(body, scale(spread(inertia), d_body));
        couple_density = couple_density - cross(theta[p], w.hdot[p]) - R * d_h;
      }
    }
    m.set(p, couple_density);
  }
  integrate(grid.adjoint, m, m);
  for (int p = 0; p < packs; ++p) {
    const Rotation<Pack> R = w.R[p];
    couple.set(p, back(R, m[p] - cross(theta[p], w.m[p])));
    force.set(p, back(R, n[p] - cross(theta[p], w.n[p])));
  }
}

/// Subtracts N [r x dt; dt] L with dt = (1 - t t^T) du/|u|: a pull keeps its size but follows the TCA's direction.
ROD_INLINE void vary_direction(const Field& kappa, const Field& lambda, const Field& offset, const Field& t,
                               const Lane& inverse_length, double pull, Field& couple, Field& force) {
  for (int p = 0; p < packs; ++p) {
    const Triad<Pack> du = lambda[p] + cross(kappa[p], offset[p]);
    const Triad<Pack> along = t[p];
    const Triad<Pack> dt = (pull * inverse_length.pack[p]) * (du - dot(along, du) * along);
    couple.set(p, couple[p] - cross(offset[p], dt));
    force.set(p, force[p] - dt);
  }
}

}  // namespace

void Rod::vary(const Work& work, const Variation& d, bool angular, Field& couple, Field& force) const {
  const StrainVariation strains{d.q.kappa, d.q.lambda, d.v.kappa, d.v.lambda, d.a.kappa, d.a.lambda};
  const auto kernel = work.moving ? (angular ? fastest<vary_loads<true, true>> : fastest<vary_loads<true, false>>)
                                  : (angular ? fastest<vary_loads<false, true>> : fastest<vary_loads<false, false>>);
  kernel(quadrature(), work, strains, section_.mass * length_ * length_ * length_, length_ * section_.inertia, couple,
         force);
}

void Rod::tangent(const Work& work, const Weights& weights, Matrix& J) const {
  const Quadrature& grid = quadrature();
  const int count = static_cast<int>(components_.size()), n = unknowns();
  J.setZero(n, n);
  Variation d;
  Field couple, force;
  for (int a = 0; a < terms_; ++a)
    for (int i = 0; i < count; ++i) {
      const int c = components_[i], column = a * count + i;
      const auto set = [&](Strain& strain, double weight) {
        Lane& out = lane(c < 3 ? strain.kappa : strain.lambda, c % 3);
        for (int p = 0; p < packs; ++p) out.pack[p] = weight * grid.legendre[a].pack[p];
      };
      set(d.q, weights.q), set(d.v, weights.v), set(d.a, weights.a);
      vary(work, d, c < 3, couple, force);
      for (std::size_t t = 0; t < tca_count; ++t)
        fastest<vary_direction>(d.q.kappa, d.q.lambda, offset_[t], work.t[t], work.inverse_length[t],
                                length_ * work.tension[t].value, couple, force);
      project(couple, force, -1.0, J.data() + column * n);
      set(d.q, 0.0), set(d.v, 0.0), set(d.a, 0.0);
    }
  J.diagonal() += weights.q * stiffness_ + weights.v * damping_;
  for (std::size_t i = 0; i < tca_count; ++i)
    if (work.tension[i].per_delta != 0.0)
      J.noalias() += (weights.q * work.tension[i].per_delta) * work.b[i] * work.b[i].transpose();
}

void Rod::rate_derivative(const Work& work, const Vector& dv, const Vector& da, Vector& dr) const {
  Variation d;
  expand(dv.data(), d.v);
  expand(da.data(), d.a);
  Field couple, force;
  vary(work, d, true, couple, force);
  dr = damping_.cwiseProduct(dv);
  project(couple, force, -1.0, dr.data());
}

void Rod::load_derivative(const Work& work, const Loads& loads, const Loads& rates, Vector& dr) const {
  dr.setZero(unknowns());
  Field couple, force;
  const Quadrature& grid = quadrature();
  const Vec3 weight = (section_.mass * length_ * length_) * rates.gravity;
  Field m;
  for (int p = 0; p < packs; ++p) {
    const Triad<Pack> n = spread(length_ * rates.tip_force) + (1.0 - grid.s.pack[p]) * spread(weight);
    force.set(p, back(work.R[p], n));
    m.set(p, cross(work.l[p], n));
  }
  integrate(grid.adjoint, m, m);
  for (int p = 0; p < packs; ++p) couple.set(p, back(work.R[p], m[p] + spread(rates.tip_moment)));
  project(couple, force, -1.0, dr.data());
  for (std::size_t i = 0; i < tca_count; ++i) {
    const Tension guessed = law_.tension(loads.delta_guess[i], loads.T[i]);
    const double rate = closure_ == Closure::inside
                            ? work.tension[i].per_T * rates.T[i]
                            : guessed.per_delta * rates.delta_guess[i] + guessed.per_T * rates.T[i];
    dr += rate * work.b[i];
  }
}

}  // namespace rod
