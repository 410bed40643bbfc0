// Construction of a uniform rod, and the terms of its equations that need no loop over nodes: stiffness and damping of
// the body (Eqs. 9-13), tensions of the TCAs (Eqs. 4 and 14).
#include "mechanics/uniform_rod.hpp"

#include <algorithm>
#include <cmath>

#include "mechanics/polynomials.hpp"
#include "numerics/kernel.hpp"

namespace rod {

UniformRod::UniformRod(const Parameters& p, const Section& section) : Rod(p), section_(section.seen_from(frame_)) {
  const Segment& body = p.segment[0];
  const double L = body.length;
  double turns = std::hypot(body.curvature[0], body.curvature[1], body.curvature[2]) * L;
  for (std::size_t i = 0; i < p.tcas; ++i) turns = std::max(turns, std::abs(p.tca[i].helix) * L);
  const Quadrature& grid = quadrature(body.order, turns);
  const auto& reference = section_.reference;
  constants_.grid = &grid;
  constants_.planar = p.planar;
  constants_.length = L;
  constants_.mass = section_.mass;
  constants_.inertia = section_.inertia;
  constants_.kappa = L * Vec3{reference[0], reference[1], reference[2]};
  constants_.lambda = {reference[3], reference[4], reference[5]};
  constants_.terms = body.order + 1;
  components_ = components_of(body.strains, p.planar, excluded_components_);
  constants_.count = static_cast<int>(components_.size());
  std::ranges::copy(components_, constants_.components.begin());

  stiffness_.resize(constants_.unknowns());
  int at = 0;
  for (int a = 0; a < constants_.terms; ++a)
    for (int c : components_) stiffness_[at++] = stiffness_per_strain(c) / (2 * a + 1);  // int P_a^2 = 1/(2a + 1)
  damping_ = section_.retardation * stiffness_;
  const double EI = std::min(section_.stiffness[0], section_.stiffness[1]);
  first_frequency_ = 3.516 * std::sqrt(EI / section_.mass) / (L * L);

  constants_.tcas = p.tcas;
  constants_.offset.resize(p.tcas);
  constants_.slope.resize(p.tcas);
  for (std::size_t i = 0; i < p.tcas; ++i) {
    const Tca& tca = p.tca[i];
    for (int k = 0; k < grid.nodes; ++k) {
      const double angle = tca.azimuth + tca.helix * L * grid.s[k];
      const double distance = tca.offset + (tca.offset_end - tca.offset) * grid.s[k];
      const Vec3 direction = frame_.to_frame(Vec3{std::cos(angle), std::sin(angle), 0.0});
      const Vec3 r = (distance / L) * direction;
      const Vec3 slope = (tca.helix * distance) * Vec3{-direction.y, direction.x, 0.0} +
                         ((tca.offset_end - tca.offset) / L) * direction;
      constants_.offset[i].put(k, r);
      constants_.slope[i].put(k, slope);
      const Vec3 u = constants_.lambda + cross(constants_.kappa, r) + slope;
      reference_path_[i] += grid.w[k] * std::sqrt(dot(u, u));
    }
  }
  acting_ = constants_;
  if (has_slack_tcas_) acting_.tcas = 0;
  residual_loops_ = residual_loops(constants_);
  tangent_loops_ = tangent_loops(constants_);
  spatial_error_loop_ = spatial_error_loop(constants_);
}

void UniformRod::residual(const double* q, const double* v, const double* a, const Loads& loads, Workspace& work,
                          Vector& r) const {
  ++work.evaluations;
  const int n = unknowns();
  r.resize(n);
  residual_loops_.dynamics(acting_, q, v, a, loads.seen_from(frame_), work, r.data(), acting_gradients(work));
  if (acting_.tcas) pull(loads, work);
  r += stiffness_.cwiseProduct(Eigen::Map<const Vector>(q, n));
  r += damping_.cwiseProduct(Eigen::Map<const Vector>(v, n));
  for (std::size_t i = 0; i < acting_.tcas; ++i)
    if (work.tension[i].value != 0.0) r += work.tension[i].value * work.b[i];
}

void UniformRod::static_residual(const double* q, const Loads& loads, Workspace& work, Vector& r) const {
  ++work.evaluations;
  const int n = unknowns();
  r.resize(n);
  residual_loops_.statics(acting_, q, loads.seen_from(frame_), work, r.data(), acting_gradients(work));
  if (acting_.tcas) pull(loads, work);
  r += stiffness_.cwiseProduct(Eigen::Map<const Vector>(q, n));
  for (std::size_t i = 0; i < acting_.tcas; ++i)
    if (work.tension[i].value != 0.0) r += work.tension[i].value * work.b[i];
}

void UniformRod::kinematics(const double* q, const double* v, const Loads& loads, Workspace& work,
                            unsigned stages) const {
  if (stages & stage::in_one_loop)
    residual_loops_.positions_and_paths(constants_, q, work, gradients(work));
  else if (stages & stage::positions)
    residual_loops_.positions(constants_, q, work);
  if ((stages & stage::tcas) && !(stages & stage::in_one_loop))
    residual_loops_.paths(constants_, q, work, gradients(work));
  if (stages & stage::tcas) pull(loads, work);
  if (stages & stage::velocities) residual_loops_.velocities(constants_, v, work);
}

unsigned UniformRod::stages_of(unsigned parts) const {
  const unsigned pulled = stage::positions | (acting_.tcas ? stage::tcas : 0);
  unsigned stages = 0;
  if (parts & (part::tip_position | part::tip_orientation | part::shape)) stages |= stage::positions;
  if (parts & part::tcas) stages |= stage::tcas;
  if (parts & part::tip_velocity) stages |= stage::positions | stage::velocities;
  if (parts & part::energy) stages |= stage::velocities | pulled;
  if (parts & part::out_of_plane && constants_.planar) stages |= pulled;
  if (parts & part::spatial_error) stages |= stage::at_rest;  // it is that of displacements too
  return stages;
}

Gradients UniformRod::gradients(Workspace& work) const {
  const std::size_t count = tcas();
  if (work.t.size() != count || work.b.size() != count) {
    work.t.resize(count), work.arm.resize(count), work.inverse_length.resize(count);
    work.b.resize(count);
  }
  Gradients b{};
  for (std::size_t i = 0; i < count; ++i) {
    work.b[i].resize(unknowns());
    b[i] = work.b[i].data();
  }
  return b;
}

Gradients UniformRod::acting_gradients(Workspace& work) const {
  if (acting_.tcas || work.b.size() != tcas()) return gradients(work);
  return {};
}

void UniformRod::pull(const Loads& loads, Workspace& work) const {
  for (std::size_t i = 0; i < tcas(); ++i) work.delta[i] = length() * (work.path[i] - reference_path_[i]);
  pull_tcas(loads, work);
}

void UniformRod::tangent(const Workspace& work, const Weights& weights, Matrix& J) const {
  J.resize(unknowns(), unknowns());
  PerTca<double> tension;
  for (std::size_t i = 0; i < acting_.tcas; ++i) tension[i] = work.tension[i].value;
  tangent_loops_.tangent(acting_, work, {weights.q, weights.v, weights.a}, tension, J.data());
  J.diagonal() += weights.q * stiffness_ + weights.v * damping_;
  for (std::size_t i = 0; i < acting_.tcas; ++i)
    if (work.tension[i].per_delta != 0.0)
      J.noalias() += (weights.q * work.tension[i].per_delta) * work.b[i] * work.b[i].transpose();
}

void UniformRod::rate_derivative(const Workspace& work, const Vector& dv, const Vector& da, Vector& dr) const {
  dr.resize(unknowns());
  tangent_loops_.rate(acting_, work, dv.data(), da.data(), dr.data());
  dr += damping_.cwiseProduct(dv);
}

void UniformRod::load_derivative(const Workspace& work, const Loads& loads, const Loads& rates, Vector& dr) const {
  const BodyLoads turned = rates.seen_from(frame_);
  dr.setZero(unknowns());
  const auto is_zero = [](const Vec3& a) { return a.x == 0.0 && a.y == 0.0 && a.z == 0.0; };
  if (!is_zero(turned.gravity) || !is_zero(turned.tip_force) || !is_zero(turned.tip_moment)) {
    const Quadrature& grid = *constants_.grid;
    const Vec3 weight = (constants_.mass * length() * length()) * turned.gravity;
    NodeArray<Triad<Pack>, kMaxPacks> n, m;
    for (int p = 0; p < kMaxPacks; ++p) {
      n[p] = broadcast(length() * turned.tip_force) + (1.0 - grid.s.pack[p]) * broadcast(weight);
      m[p] = cross(work.l[p], n[p]);
    }
    m = integral(grid.adjoint, m);
    VectorField couple, force;
    for (int p = 0; p < kMaxPacks; ++p) {
      const Rotation<Pack> R = work.R[p];
      couple.set(p, transpose_times(R, m[p] + broadcast(turned.tip_moment)));
      force.set(p, transpose_times(R, n[p]));
    }
    project<kMaxPacks>(constants_, couple, force, -1.0, dr.data());
  }
  for (std::size_t i = 0; i < acting_.tcas; ++i) {
    const Tension guessed = laws_[i].tension(loads.delta_guess[i], loads.T[i]);
    const double rate = closure_ == Closure::inside
                            ? work.tension[i].per_T * rates.T[i]
                            : guessed.per_delta * rates.delta_guess[i] + guessed.per_T * rates.T[i];
    dr += rate * work.b[i];
  }
}

UniformRod::StrainRange UniformRod::strain_range(const double* q) const {
  const Quadrature& grid = *constants_.grid;
  // Legendre's polynomials are at most 1, so a strain is at most the sum of its coefficients. Where that is within the
  // range already, as in most rods, the bounds are answer enough.
  double bend = std::sqrt(dot(constants_.kappa, constants_.kappa)), compression = 0.0;
  const double* coefficient = q;
  for (int a = 0; a < constants_.terms; ++a)
    for (const int c : components_) {
      const double size = std::abs(*coefficient++);
      if (c < 3) bend += size;
      if (c == 5) compression += size;
    }
  if (bend <= grid.max_curvature && compression < constants_.lambda.z)
    return {.curvature = bend, .max_curvature = grid.max_curvature, .stretch = constants_.lambda.z - compression};
  VectorField kappa, lambda;
  for (int p = 0; p < grid.packs; ++p)
    kappa.set(p, broadcast(constants_.kappa)), lambda.set(p, broadcast(constants_.lambda));
  add_expansion<kMaxPacks>(constants_, q, kappa, lambda);
  Pack largest{}, least = Pack{} + lambda.z[0];
  for (int p = 0; p < grid.packs; ++p) {
    const Pack square = dot(kappa[p], kappa[p]), stretch = lambda.z.pack[p];
    largest = square > largest ? square : largest;
    least = stretch < least ? stretch : least;
  }
  return {.curvature = std::sqrt(std::max(std::max(largest[0], largest[1]), std::max(largest[2], largest[3]))),
          .max_curvature = grid.max_curvature,
          .stretch = std::min(std::min(least[0], least[1]), std::min(least[2], least[3]))};
}

void UniformRod::to_states(const double* unknowns, double* states) const {
  for (int a = 0; a < constants_.terms; ++a, states += 6) {
    std::array<double, 6> own{};
    for (int c : components_) own[c] = *unknowns++;
    for (int first : {0, 3}) {
      const Vec3 seen = frame_.from_frame({own[first], own[first + 1], own[first + 2]});
      states[first] = seen.x, states[first + 1] = seen.y, states[first + 2] = seen.z;
    }
  }
}

void UniformRod::from_states(const double* states, double* unknowns) const {
  for (int a = 0; a < constants_.terms; ++a, states += 6)
    for (int c : components_) {
      const int first = c / 3 * 3;
      const Vec3 own = frame_.to_frame(Vec3{states[first], states[first + 1], states[first + 2]});
      *unknowns++ = c % 3 == 0 ? own.x : c % 3 == 1 ? own.y : own.z;
    }
}

}  // namespace rod
