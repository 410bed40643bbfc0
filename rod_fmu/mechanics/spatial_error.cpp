// Estimate of the error of the strain polynomials at an equilibrium, from the balance of the sections between them.
//
// At the exact solution every section satisfies K (xi - xi*) + sum N_i [r_i x t_i; t_i] = [R^T m; R^T n] (Eqs. 9-14);
// the polynomials satisfy only its projection. The strain that is missing at a node,
//   d(s) = K^-1 ([R^T m; R^T n] - sum N_i [r_i x t_i; t_i]) - Phi q,
// has no part in the span of the polynomials. Its first-order effect on the shape and the displacements is the
// estimate:
//   dtheta(s) = int_0^s R dkappa ds,   dp(s) = int_0^s (dtheta x p' + R dlambda) ds,   ddelta_i = int b_i . d ds.
#include <algorithm>
#include <cmath>

#include "mechanics/polynomials.hpp"
#include "mechanics/space.hpp"
#include "mechanics/uniform_rod.hpp"
#include "numerics/kernel.hpp"

namespace rod {

namespace {

/// Internal wrench without inertia minus that of the TCAs at these tensions [N m]: [R^T m; R^T n] - sum N_i [r_i x t_i;
/// t_i].
template <int packs>
ROD_INLINE void body_wrench(const RodConstants& rod, const Kinematics& w, const BodyLoads& loads,
                            const PerTca<double>& tension, VectorField& couple, VectorField& force) {
  const Quadrature& grid = *rod.grid;
  const Vec3 weight = (rod.mass * rod.length * rod.length) * loads.gravity;
  NodeArray<Triad<Pack>, packs> n{}, m{};
  for (int p = 0; p < packs; ++p) {
    n[p] = broadcast(rod.length * loads.tip_force) + (1.0 - grid.s.pack[p]) * broadcast(weight);
    m[p] = cross(w.l[p], n[p]);
  }
  m = integral(grid.adjoint, m);
  for (int p = 0; p < packs; ++p) {
    const Rotation<Pack> R = w.R[p];
    couple.set(p, transpose_times(R, m[p] + broadcast(loads.tip_moment)));
    force.set(p, transpose_times(R, n[p]));
    for (std::size_t i = 0; i < rod.tcas; ++i) {
      const double pull = rod.length * tension[i];
      couple.set(p, couple[p] - pull * w.arm[i][p]);
      force.set(p, force[p] - pull * w.t[i][p]);
    }
  }
}

template <int packs>
ROD_INLINE double largest_effect(const RodConstants& rod, const Kinematics& w, const BodyLoads& loads,
                                 const PerTca<double>& tension, const std::array<double, 6>& stiffness,
                                 const double* q) {
  const Quadrature& grid = *rod.grid;
  VectorField couple, force, kappa, lambda;
  body_wrench<packs>(rod, w, loads, tension, couple, force);
  add_expansion<packs>(rod, q, kappa, lambda);
  VectorField dkappa, dlambda;  // the missing strains
  for (int i = 0; i < rod.count; ++i) {
    const int c = rod.components[i];
    const ScalarField& density = component(c < 3 ? couple : force, c % 3);
    const ScalarField& strain = component(c < 3 ? kappa : lambda, c % 3);
    ScalarField& missing = component(c < 3 ? dkappa : dlambda, c % 3);
    const double compliance = 1.0 / stiffness[c];
    for (int p = 0; p < packs; ++p) missing.pack[p] = compliance * density.pack[p] - strain.pack[p];
    // Loads that changed since the equilibrium leave a part within the polynomials, which is not their error.
    for (int a = 0; a < rod.terms; ++a) {
      const double coefficient = (2 * a + 1) * weighted_sum<packs>(grid.moment[a], missing);
      for (int p = 0; p < packs; ++p) missing.pack[p] -= coefficient * grid.legendre[a].pack[p];
    }
  }
  NodeArray<Triad<Pack>, packs> theta{}, shift{};
  for (int p = 0; p < packs; ++p) theta[p] = w.R[p] * dkappa[p];
  theta = integral(grid.forward, theta);
  for (int p = 0; p < packs; ++p) shift[p] = cross(theta[p], w.l[p]) + w.R[p] * dlambda[p];
  shift = integral(grid.forward, shift);
  Pack largest{};  // squared
  for (int p = 0; p < packs; ++p) {
    const Pack square = dot(shift[p], shift[p]);
    largest = square > largest ? square : largest;
  }
  double error = std::sqrt(std::max(std::max(largest[0], largest[1]), std::max(largest[2], largest[3])));
  for (std::size_t i = 0; i < rod.tcas; ++i) {
    Pack sum{};
    for (int p = 0; p < packs; ++p) sum += grid.w.pack[p] * (dot(w.arm[i][p], dkappa[p]) + dot(w.t[i][p], dlambda[p]));
    error = std::max(error, std::abs((sum[0] + sum[1]) + (sum[2] + sum[3])));
  }
  return rod.length * error;
}

struct SpatialError {
  template <class, int packs>
  static SpatialErrorLoop of() {
    return dispatch<largest_effect<packs>>;
  }
};

}  // namespace

SpatialErrorLoop spatial_error_loop(const RodConstants& rod) { return select_loop<SpatialError>(rod); }

double UniformRod::spatial_error(const double* q, const Loads& loads, Workspace& w) const {
  PerTca<double> tension{};
  for (std::size_t i = 0; i < tcas(); ++i) tension[i] = w.tension[i].value;
  std::array<double, 6> stiffness{};
  for (int c : components_) stiffness[static_cast<std::size_t>(c)] = stiffness_per_strain(c);
  return spatial_error_loop_(constants_, w, loads.seen_from(frame_), tension, stiffness, q);
}

double missing_share(const double* q, int terms, const std::vector<int>& components) {
  // The last two degrees, relative to the two before them, extrapolate to the two that are missing (a symmetric load
  // excites every second degree only). A strain of degree p moves the centreline by its integral, about L/(2 p + 1) of
  // it, a curvature by the integral of its integral.
  const int count = static_cast<int>(components.size());
  const double degree = 2.0 * terms + 1.0;
  double sum = 0.0;
  for (int i = 0; i < count; ++i) {
    const auto amplitude = [&](int a) { return a >= 0 ? std::abs(q[a * count + i]) : 0.0; };
    const double last = amplitude(terms - 1) + amplitude(terms - 2);
    const double before = amplitude(terms - 3) + amplitude(terms - 4);
    const double missing = last * std::min(1.0, terms < 3 || before == 0.0 ? 1.0 : last / before);
    sum += missing / (components[i] < 3 ? degree * degree : degree);
  }
  return sum;
}

double UniformRod::spatial_error(const double* q) const {
  return length() * missing_share(q, constants_.terms, components_);
}

}  // namespace rod
