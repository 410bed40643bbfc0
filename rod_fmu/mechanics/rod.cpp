// Construction of a rod, and the terms of its equations that need no loop over nodes: stiffness and damping of the body
// (Eqs. 9-13), tensions of the TCAs (Eqs. 4 and 14).
#include "mechanics/rod.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "mechanics/polynomials.hpp"
#include "numerics/kernel.hpp"

namespace rod {

namespace {

std::vector<int> components_of(Strains strains) {
  switch (strains) {
    case Strains::bending:
      return {0, 1};
    case Strains::extensible:
      return {0, 1, 5};
    case Strains::kirchhoff:
      return {0, 1, 2, 5};
    case Strains::cosserat:
      break;
  }
  return {0, 1, 2, 3, 4, 5};
}

bool leaves_plane(int c) { return c == 0 || c == 2 || c == 4; }

}  // namespace

Rod::Rod(const Parameters& p, const Section& section)
    : frame_(p.planar ? Frame{std::cos(p.plane), std::sin(p.plane)} : Frame{}),
      section_(section.seen_from(frame_)),
      law_(p),
      closure_(p.closure) {
  double turns = std::hypot(p.body_curvature[0], p.body_curvature[1], p.body_curvature[2]) * p.body_length;
  for (double helix : p.tca_helix) turns = std::max(turns, std::abs(helix) * p.body_length);
  const Quadrature& grid = quadrature(p.order, turns);
  const auto& reference = section_.reference;
  constants_.grid = &grid;
  constants_.planar = p.planar;
  constants_.length = p.body_length;
  constants_.mass = section_.mass;
  constants_.inertia = section_.inertia;
  constants_.kappa = p.body_length * Vec3{reference[0], reference[1], reference[2]};
  constants_.lambda = {reference[3], reference[4], reference[5]};
  constants_.terms = p.order + 1;
  for (int c : components_of(p.strains))
    (p.planar && leaves_plane(c) ? excluded_components_ : components_).push_back(c);
  constants_.count = static_cast<int>(components_.size());
  std::ranges::copy(components_, constants_.components.begin());

  stiffness_.resize(unknowns());
  int at = 0;
  for (int a = 0; a < constants_.terms; ++a)
    for (int c : components_) stiffness_[at++] = stiffness_per_strain(c) / (2 * a + 1);  // int P_a^2 = 1/(2a + 1)
  damping_ = section_.retardation * stiffness_;

  for (std::size_t i = 0; i < kTcas; ++i)
    for (int k = 0; k < grid.nodes; ++k) {
      const double angle = p.tca_azimuth[i] + p.tca_helix[i] * p.body_length * grid.s[k];
      const Vec3 direction = frame_.to_frame(Vec3{std::cos(angle), std::sin(angle), 0.0});
      const Vec3 r = (p.tca_offset / p.body_length) * direction;
      const Vec3 slope = (p.tca_helix[i] * p.tca_offset) * Vec3{-direction.y, direction.x, 0.0};
      constants_.offset[i].put(k, r);
      constants_.slope[i].put(k, slope);
      const Vec3 u = constants_.lambda + cross(constants_.kappa, r) + slope;
      reference_path_[i] += grid.w[k] * std::sqrt(dot(u, u));
    }
  residual_loops_ = residual_loops(constants_);
  tangent_loops_ = tangent_loops(constants_);
}

double Rod::first_frequency() const {
  const double EI = std::min(section_.stiffness[0], section_.stiffness[1]);
  return 3.516 * std::sqrt(EI / section_.mass) / (length() * length());
}

void Rod::residual(const double* q, const double* v, const double* a, const Loads& loads, Workspace& work,
                   Vector& r) const {
  ++work.evaluations;
  const int n = unknowns();
  r.resize(n);
  residual_loops_.dynamics(constants_, q, v, a, loads.seen_from(frame_), work, r.data(), gradients(work));
  pull_tcas(loads, work);
  r += stiffness_.cwiseProduct(Eigen::Map<const Vector>(q, n));
  r += damping_.cwiseProduct(Eigen::Map<const Vector>(v, n));
  for (std::size_t i = 0; i < kTcas; ++i) r += work.tension[i].value * work.b[i];
}

void Rod::static_residual(const double* q, const Loads& loads, Workspace& work, Vector& r) const {
  ++work.evaluations;
  const int n = unknowns();
  r.resize(n);
  residual_loops_.statics(constants_, q, loads.seen_from(frame_), work, r.data(), gradients(work));
  pull_tcas(loads, work);
  r += stiffness_.cwiseProduct(Eigen::Map<const Vector>(q, n));
  for (std::size_t i = 0; i < kTcas; ++i) r += work.tension[i].value * work.b[i];
}

void Rod::kinematics(const double* q, const double* v, const Loads& loads, Workspace& work) const {
  residual_loops_.kinematics(constants_, q, v, work, gradients(work));
  pull_tcas(loads, work);
}

Gradients Rod::gradients(Workspace& work) const {
  Gradients b;
  for (std::size_t i = 0; i < kTcas; ++i) {
    work.b[i].resize(unknowns());
    b[i] = work.b[i].data();
  }
  return b;
}

void Rod::pull_tcas(const Loads& loads, Workspace& work) const {
  const bool inside = closure_ == Closure::inside;
  for (std::size_t i = 0; i < kTcas; ++i) {
    work.delta[i] = length() * (work.path[i] - reference_path_[i]);
    work.tension[i] = law_.tension(inside ? work.delta[i] : loads.delta_guess[i], loads.T[i]);
    if (!inside) work.tension[i].per_delta = 0.0;  // the force does not follow this rod's own displacement
  }
}

void Rod::tangent(const Workspace& work, const Weights& weights, Matrix& J) const {
  J.resize(unknowns(), unknowns());
  PerTca<double> tension;
  for (std::size_t i = 0; i < kTcas; ++i) tension[i] = work.tension[i].value;
  tangent_loops_.tangent(constants_, work, {weights.q, weights.v, weights.a}, tension, J.data());
  J.diagonal() += weights.q * stiffness_ + weights.v * damping_;
  for (std::size_t i = 0; i < kTcas; ++i)
    if (work.tension[i].per_delta != 0.0)
      J.noalias() += (weights.q * work.tension[i].per_delta) * work.b[i] * work.b[i].transpose();
}

void Rod::add_tca_stiffness(const Workspace& work, const Loads& loads, Matrix& J) const {
  if (closure_ == Closure::inside) return;
  for (std::size_t i = 0; i < kTcas; ++i)
    J.noalias() += law_.tension(work.delta[i], loads.T[i]).per_delta * work.b[i] * work.b[i].transpose();
}

void Rod::rate_derivative(const Workspace& work, const Vector& dv, const Vector& da, Vector& dr) const {
  dr.resize(unknowns());
  tangent_loops_.rate(constants_, work, dv.data(), da.data(), dr.data());
  dr += damping_.cwiseProduct(dv);
}

void Rod::load_derivative(const Workspace& work, const Loads& loads, const Loads& rates, Vector& dr) const {
  const Loads legendre_integral = rates.seen_from(frame_);
  dr.setZero(unknowns());
  const auto is_zero = [](const Vec3& a) { return a.x == 0.0 && a.y == 0.0 && a.z == 0.0; };
  if (!is_zero(legendre_integral.gravity) || !is_zero(legendre_integral.tip_force) ||
      !is_zero(legendre_integral.tip_moment)) {
    const Quadrature& grid = *constants_.grid;
    const Vec3 weight = (constants_.mass * length() * length()) * legendre_integral.gravity;
    NodeArray<Triad<Pack>, kMaxPacks> n, m;
    for (int p = 0; p < kMaxPacks; ++p) {
      n[p] = broadcast(length() * legendre_integral.tip_force) + (1.0 - grid.s.pack[p]) * broadcast(weight);
      m[p] = cross(work.l[p], n[p]);
    }
    m = integral(grid.adjoint, m);
    VectorField couple, force;
    for (int p = 0; p < kMaxPacks; ++p) {
      const Rotation<Pack> R = work.R[p];
      couple.set(p, transpose_times(R, m[p] + broadcast(legendre_integral.tip_moment)));
      force.set(p, transpose_times(R, n[p]));
    }
    project<kMaxPacks>(constants_, couple, force, -1.0, dr.data());
  }
  for (std::size_t i = 0; i < kTcas; ++i) {
    const Tension guessed = law_.tension(loads.delta_guess[i], loads.T[i]);
    const double rate = closure_ == Closure::inside
                            ? work.tension[i].per_T * rates.T[i]
                            : guessed.per_delta * rates.delta_guess[i] + guessed.per_T * rates.T[i];
    dr += rate * work.b[i];
  }
}

Rod::StrainRange Rod::strain_range(const double* q) const {
  const Quadrature& grid = *constants_.grid;
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
          .stretch = std::min(std::min(least[0], least[1]), std::min(least[2], least[3]))};
}

bool Rod::is_admissible(const double* q) const {
  const StrainRange range = strain_range(q);
  return Eigen::Map<const Vector>(q, unknowns()).allFinite() && range.curvature <= constants_.grid->max_curvature &&
         range.stretch > 0.0;
}

core::Status Rod::check_strains(const double* q) const {
  if (is_admissible(q)) return {};
  const StrainRange range = strain_range(q);
  std::ostringstream what;
  if (range.curvature > constants_.grid->max_curvature)
    what << "the rod's curvature times its length is " << range.curvature
         << " rad; the quadrature of this order resolves " << constants_.grid->max_curvature << " rad";
  else if (range.stretch <= 0.0)
    what << "the rod's stretch is " << range.stretch
         << "; a section would lie behind its neighbours, it must be positive";
  else
    what << "the rod's strains are not finite";
  return core::Status::discard(what.str(), "reduce the loads or the heat, or raise order");
}

void Rod::to_states(const double* unknowns, double* states) const {
  for (int a = 0; a < constants_.terms; ++a, states += 6) {
    std::array<double, 6> own{};
    for (int c : components_) own[c] = *unknowns++;
    for (int first : {0, 3}) {
      const Vec3 seen = frame_.from_frame({own[first], own[first + 1], own[first + 2]});
      states[first] = seen.x, states[first + 1] = seen.y, states[first + 2] = seen.z;
    }
  }
}

void Rod::from_states(const double* states, double* unknowns) const {
  for (int a = 0; a < constants_.terms; ++a, states += 6)
    for (int c : components_) {
      const int first = c / 3 * 3;
      const Vec3 own = frame_.to_frame(Vec3{states[first], states[first + 1], states[first + 2]});
      *unknowns++ = c % 3 == 0 ? own.x : c % 3 == 1 ? own.y : own.z;
    }
}

}  // namespace rod
