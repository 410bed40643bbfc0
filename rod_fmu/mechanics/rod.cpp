// Construction, and what surrounds the loops over nodes: the TCAs' law, the body's stiffness and damping.
#include "mechanics/rod.hpp"

#include <algorithm>
#include <cmath>

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

Rod::Rod(const Parameters& p, const Section& given)
    : frame_(p.planar ? Frame{std::cos(p.plane), std::sin(p.plane)} : Frame{}),
      section_(given.seen_from(frame_)),
      law_(p),
      closure_(p.closure) {
  const Quadrature& grid = quadrature(p.order);
  const auto& reference = section_.reference;
  build_.grid = &grid;
  build_.planar = p.planar;
  build_.length = p.body_length;
  build_.mass = section_.mass;
  build_.inertia = section_.inertia;
  build_.kappa = p.body_length * Vec3{reference[0], reference[1], reference[2]};
  build_.lambda = {reference[3], reference[4], reference[5]};
  build_.terms = p.order + 1;
  for (int c : components_of(p.strains)) (p.planar && leaves_plane(c) ? left_out_ : components_).push_back(c);
  build_.count = static_cast<int>(components_.size());
  std::ranges::copy(components_, build_.components.begin());

  stiffness_.resize(unknowns());
  int at = 0;
  for (int a = 0; a < build_.terms; ++a)
    for (int c : components_) stiffness_[at++] = stiffness_per_strain(c) / (2 * a + 1);  // int P_a^2 = 1/(2a + 1)
  damping_ = section_.retardation * stiffness_;

  for (std::size_t i = 0; i < tca_count; ++i)
    for (int k = 0; k < grid.nodes; ++k) {
      const double angle = p.tca_azimuth[i] + p.tca_helix[i] * p.body_length * grid.s[k];
      const Vec3 direction = frame_.in(Vec3{std::cos(angle), std::sin(angle), 0.0});
      const Vec3 r = (p.tca_offset / p.body_length) * direction;
      const Vec3 slope = (p.tca_helix[i] * p.tca_offset) * Vec3{-direction.y, direction.x, 0.0};
      build_.offset[i].put(k, r);
      build_.slope[i].put(k, slope);
      const Vec3 u = build_.lambda + cross(build_.kappa, r) + slope;
      reference_path_[i] += grid.w[k] * std::sqrt(dot(u, u));
    }
  residual_ = residual_loop(build_);
  tangent_ = tangent_loop(build_);
  rates_ = rate_loop(build_);
}

double Rod::first_frequency() const {
  const double EI = std::min(section_.stiffness[0], section_.stiffness[1]);
  return 3.516 * std::sqrt(EI / section_.mass) / (length() * length());
}

void Rod::residual(const double* q, const double* v, const double* a, const Loads& loads, Work& work, Vector& r) const {
  ++evaluations_;
  const int n = unknowns();
  r.resize(n);
  go_along(q, v, a, loads, work, r.data());
  r += stiffness_.cwiseProduct(Eigen::Map<const Vector>(q, n));
  if (work.moving) r += damping_.cwiseProduct(Eigen::Map<const Vector>(v, n));
  for (std::size_t i = 0; i < tca_count; ++i) r += work.tension[i].value * work.b[i];
}

void Rod::look(const double* q, const double* v, const Loads& loads, Work& work) const {
  go_along(q, v, nullptr, loads, work, nullptr);
}

void Rod::go_along(const double* q, const double* v, const double* a, const Loads& loads, Work& work, double* r) const {
  std::array<double*, tca_count> b;
  for (std::size_t i = 0; i < tca_count; ++i) {
    work.b[i].resize(unknowns());
    b[i] = work.b[i].data();
  }
  residual_(build_, q, v, a, loads.seen_from(frame_), work, r, b);
  for (std::size_t i = 0; i < tca_count; ++i) {
    const bool inside = closure_ == Closure::inside;
    work.delta[i] = length() * (work.path[i] - reference_path_[i]);
    work.tension[i] = law_.tension(inside ? work.delta[i] : loads.delta_guess[i], loads.T[i]);
    if (!inside) work.tension[i].per_delta = 0.0;  // the force does not follow this rod's own displacement
  }
}

void Rod::tangent(const Work& work, const Weights& weights, Matrix& J) const {
  J.resize(unknowns(), unknowns());
  PerTca<double> pull;
  for (std::size_t i = 0; i < tca_count; ++i) pull[i] = work.tension[i].value;
  tangent_(build_, work, {weights.q, weights.v, weights.a}, pull, J.data());
  J.diagonal() += weights.q * stiffness_ + weights.v * damping_;
  for (std::size_t i = 0; i < tca_count; ++i)
    if (work.tension[i].per_delta != 0.0)
      J.noalias() += (weights.q * work.tension[i].per_delta) * work.b[i] * work.b[i].transpose();
}

void Rod::rate_derivative(const Work& work, const Vector& dv, const Vector& da, Vector& dr) const {
  dr.resize(unknowns());
  rates_(build_, work, dv.data(), da.data(), dr.data());
  dr += damping_.cwiseProduct(dv);
}

void Rod::load_derivative(const Work& work, const Loads& loads, const Loads& rates, Vector& dr) const {
  const Loads turned = rates.seen_from(frame_);
  dr.setZero(unknowns());
  const auto still = [](const Vec3& a) { return a.x == 0.0 && a.y == 0.0 && a.z == 0.0; };
  if (!still(turned.gravity) || !still(turned.tip_force) || !still(turned.tip_moment)) {
    const Quadrature& grid = *build_.grid;
    const Vec3 weight = (build_.mass * length() * length()) * turned.gravity;
    Along<Triad<Pack>, most_packs> n, m;
    for (int p = 0; p < most_packs; ++p) {
      n[p] = spread(length() * turned.tip_force) + (1.0 - grid.s.pack[p]) * spread(weight);
      m[p] = cross(work.l[p], n[p]);
    }
    m = integral(grid.adjoint, m);
    Field couple, force;
    for (int p = 0; p < most_packs; ++p) {
      const Rotation<Pack> R = work.R[p];
      couple.set(p, back(R, m[p] + spread(turned.tip_moment)));
      force.set(p, back(R, n[p]));
    }
    moments<most_packs>(build_, couple, force, -1.0, dr.data());
  }
  for (std::size_t i = 0; i < tca_count; ++i) {
    const Tension guessed = law_.tension(loads.delta_guess[i], loads.T[i]);
    const double rate = closure_ == Closure::inside
                            ? work.tension[i].per_T * rates.T[i]
                            : guessed.per_delta * rates.delta_guess[i] + guessed.per_T * rates.T[i];
    dr += rate * work.b[i];
  }
}

void Rod::to_states(const double* unknowns, double* states) const {
  for (int a = 0; a < build_.terms; ++a, states += 6) {
    std::array<double, 6> own{};
    for (int c : components_) own[c] = *unknowns++;
    for (int first : {0, 3}) {
      const Vec3 seen = frame_.out({own[first], own[first + 1], own[first + 2]});
      states[first] = seen.x, states[first + 1] = seen.y, states[first + 2] = seen.z;
    }
  }
}

void Rod::from_states(const double* states, double* unknowns) const {
  for (int a = 0; a < build_.terms; ++a, states += 6)
    for (int c : components_) {
      const int first = c / 3 * 3;
      const Vec3 own = frame_.in(Vec3{states[first], states[first + 1], states[first + 2]});
      *unknowns++ = c % 3 == 0 ? own.x : c % 3 == 1 ? own.y : own.z;
    }
}

}  // namespace rod
