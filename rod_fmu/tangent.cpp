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
    for (int k = 0; k < nodes; ++k) theta.set(k, w.R[k] * d.kappa[k]);
    integrate(grid.forward, theta, theta);
  }
  for (int k = 0; k < nodes; ++k) l.set(k, cross(theta[k], w.l[k]) + w.R[k] * d.lambda[k]);

  if constexpr (moving) {
    if constexpr (angular) {
      Field k1;
      for (int k = 0; k < nodes; ++k) k1.set(k, cross(theta[k], w.k1[k]) + w.R[k] * d.kappa1[k]);
      integrate(grid.forward, k1, omega);
      for (int k = 0; k < nodes; ++k)
        alpha.set(
            k, cross(omega[k], w.k1[k]) + cross(w.omega[k], k1[k]) + cross(theta[k], w.k2[k]) + w.R[k] * d.kappa2[k]);
      integrate(grid.forward, alpha, alpha);
    }
    for (int k = 0; k < nodes; ++k) {
      const Mat3 R = w.R[k];
      const Vec3 l1 = cross(theta[k], w.l1[k]) + R * d.lambda1[k];
      const Vec3 l2 = cross(theta[k], w.l2[k]) + R * d.lambda2[k];
      const Vec3 swing = cross(w.omega[k], w.l[k]) + 2.0 * w.l1[k];
      const Vec3 d_swing = cross(omega[k], w.l[k]) + cross(w.omega[k], l[k]) + 2.0 * l1;
      n.set(k, cross(alpha[k], w.l[k]) + cross(w.alpha[k], l[k]) + cross(omega[k], swing) + cross(w.omega[k], d_swing) +
                   l2);
    }
    integrate(grid.forward, n, n);
    for (int k = 0; k < nodes; ++k) n.set(k, -mass_length_3 * n[k]);
    integrate(grid.adjoint, n, n);
  }

  for (int k = 0; k < nodes; ++k) {
    Vec3 couple_density = cross(l[k], w.n[k]);
    if constexpr (moving) {
      couple_density = couple_density + cross(w.l[k], n[k]);
      if constexpr (angular) {
        const Mat3 R = w.R[k];
        const Vec3 body = w.omega_body[k];
        const Vec3 d_body = back(R, omega[k] - cross(theta[k], w.omega[k]));
        const Vec3 d_alpha = back(R, alpha[k] - cross(theta[k], w.alpha[k]));
        const Vec3 d_h =
            scale(inertia, d_alpha) + cross(d_body, scale(inertia, body)) + cross(body, scale(inertia, d_body));
        couple_density = couple_density - cross(theta[k], w.hdot[k]) - R * d_h;
      }
    }
    m.set(k, couple_density);
  }
  integrate(grid.adjoint, m, m);
  for (int k = 0; k < nodes; ++k) {
    const Mat3 R = w.R[k];
    couple.set(k, back(R, m[k] - cross(theta[k], w.m[k])));
    force.set(k, back(R, n[k] - cross(theta[k], w.n[k])));
  }
}

ROD_KERNEL void vary_moving_angular(const Quadrature& grid, const Work& w, const StrainVariation& d, double mass,
                                    const Vec3& inertia, Field& couple, Field& force) {
  vary_loads<true, true>(grid, w, d, mass, inertia, couple, force);
}
ROD_KERNEL void vary_moving_linear(const Quadrature& grid, const Work& w, const StrainVariation& d, double mass,
                                   const Vec3& inertia, Field& couple, Field& force) {
  vary_loads<true, false>(grid, w, d, mass, inertia, couple, force);
}
ROD_KERNEL void vary_static_angular(const Quadrature& grid, const Work& w, const StrainVariation& d, double mass,
                                    const Vec3& inertia, Field& couple, Field& force) {
  vary_loads<false, true>(grid, w, d, mass, inertia, couple, force);
}
ROD_KERNEL void vary_static_linear(const Quadrature& grid, const Work& w, const StrainVariation& d, double mass,
                                   const Vec3& inertia, Field& couple, Field& force) {
  vary_loads<false, false>(grid, w, d, mass, inertia, couple, force);
}

/// Subtracts N [r x dt; dt] L with dt = (1 - t t^T) du/|u|: a pull keeps its size but follows the TCA's direction.
ROD_KERNEL void vary_direction(const Field& kappa, const Field& lambda, const Field& offset, const Field& t,
                               const Lane& inverse_length, double pull, Field& couple, Field& force) {
  for (int k = 0; k < nodes; ++k) {
    const Vec3 du = lambda[k] + cross(kappa[k], offset[k]);
    const Vec3 along = t[k];
    const Vec3 dt = (pull * inverse_length[k]) * (du - dot(along, du) * along);
    couple.set(k, couple[k] - cross(offset[k], dt));
    force.set(k, force[k] - dt);
  }
}

}  // namespace

void Rod::vary(const Work& work, const Variation& d, bool angular, Field& couple, Field& force) const {
  const StrainVariation strains{d.q.kappa, d.q.lambda, d.v.kappa, d.v.lambda, d.a.kappa, d.a.lambda};
  const auto kernel = work.moving ? (angular ? vary_moving_angular : vary_moving_linear)
                                  : (angular ? vary_static_angular : vary_static_linear);
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
    for (int p = 0; p < count; ++p) {
      const int c = components_[p], column = a * count + p;
      const auto set = [&](Strain& strain, double weight) {
        Lane& out = lane(c < 3 ? strain.kappa : strain.lambda, c % 3);
        for (int k = 0; k < nodes; ++k) out[k] = weight * grid.legendre[a][k];
      };
      set(d.q, weights.q), set(d.v, weights.v), set(d.a, weights.a);
      vary(work, d, c < 3, couple, force);
      for (std::size_t i = 0; i < tca_count; ++i)
        vary_direction(d.q.kappa, d.q.lambda, offset_[i], work.t[i], work.inverse_length[i],
                       length_ * work.tension[i].value, couple, force);
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
  for (int k = 0; k < nodes; ++k) {
    const Vec3 n = length_ * rates.tip_force + (1.0 - grid.s[k]) * weight;
    force.set(k, back(work.R[k], n));
    m.set(k, cross(work.l[k], n));
  }
  integrate(grid.adjoint, m, m);
  for (int k = 0; k < nodes; ++k) couple.set(k, back(work.R[k], m[k] + rates.tip_moment));
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
