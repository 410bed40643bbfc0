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
#include "mechanics/uniform_rod.hpp"
#include "numerics/kernel.hpp"

namespace rod {

double UniformRod::spatial_error(const double* q, const Loads& loads, Workspace& w) const {
  const Quadrature& grid = *constants_.grid;
  const BodyLoads turned = loads.seen_from(frame_);
  const Vec3 weight = (constants_.mass * length() * length()) * turned.gravity;
  NodeArray<Triad<Pack>, kMaxPacks> n{}, m{};
  for (int p = 0; p < grid.packs; ++p) {
    n[p] = broadcast(length() * turned.tip_force) + (1.0 - grid.s.pack[p]) * broadcast(weight);
    m[p] = cross(w.l[p], n[p]);
  }
  m = integral(grid.adjoint, m);
  VectorField couple, force, kappa, lambda;
  for (int p = 0; p < grid.packs; ++p) {
    const Rotation<Pack> R = w.R[p];
    couple.set(p, transpose_times(R, m[p] + broadcast(turned.tip_moment)));
    force.set(p, transpose_times(R, n[p]));
    for (std::size_t i = 0; i < tcas(); ++i) {
      const double tension = length() * w.tension[i].value;
      couple.set(p, couple[p] - tension * w.arm[i][p]);
      force.set(p, force[p] - tension * w.t[i][p]);
    }
  }
  add_expansion<kMaxPacks>(constants_, q, kappa, lambda);
  VectorField dkappa, dlambda;  // the missing strains
  for (int c : components_) {
    const ScalarField& density = component(c < 3 ? couple : force, c % 3);
    const ScalarField& strain = component(c < 3 ? kappa : lambda, c % 3);
    ScalarField& missing = component(c < 3 ? dkappa : dlambda, c % 3);
    const double compliance = 1.0 / stiffness_per_strain(c);
    for (int p = 0; p < grid.packs; ++p) missing.pack[p] = compliance * density.pack[p] - strain.pack[p];
    // Loads that changed since the equilibrium leave a part within the polynomials, which is not their error.
    for (int a = 0; a < constants_.terms; ++a) {
      const double coefficient = (2 * a + 1) * weighted_sum(grid.moment[a], missing);
      for (int p = 0; p < grid.packs; ++p) missing.pack[p] -= coefficient * grid.legendre[a].pack[p];
    }
  }
  NodeArray<Triad<Pack>, kMaxPacks> theta{}, shift{};
  for (int p = 0; p < grid.packs; ++p) theta[p] = w.R[p] * dkappa[p];
  theta = integral(grid.forward, theta);
  for (int p = 0; p < grid.packs; ++p) shift[p] = cross(theta[p], w.l[p]) + w.R[p] * dlambda[p];
  shift = integral(grid.forward, shift);
  double largest = 0.0;
  for (int p = 0; p < grid.packs; ++p) {
    const Pack square = dot(shift[p], shift[p]);
    for (int k = 0; k < kPackSize; ++k) largest = std::max(largest, std::sqrt(square[k]));
  }
  for (std::size_t i = 0; i < tcas(); ++i) {
    double sum = 0.0;
    for (int p = 0; p < grid.packs; ++p) {
      const Pack density = grid.w.pack[p] * (dot(w.arm[i][p], dkappa[p]) + dot(w.t[i][p], dlambda[p]));
      sum += (density[0] + density[1]) + (density[2] + density[3]);
    }
    largest = std::max(largest, std::abs(sum));
  }
  return length() * largest;
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
