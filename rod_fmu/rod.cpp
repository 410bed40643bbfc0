// Construction and the residual. Sources: Boyer et al. (2021) and Mathew et al. (2023) for strain-parametrised rods;
// the integrals in the fixed frame (omega' = R kappa., p.' = omega x p' + R lambda.) replace their recursions on SE(3).
#include "rod.hpp"

#include <cmath>
#include <numbers>

#include "kernel.hpp"
#include "rotations.hpp"

namespace rod {

Section Section::of(const Parameters& p) {
  const double area = std::numbers::pi * p.body_radius * p.body_radius;
  const double second_moment = area * p.body_radius * p.body_radius / 4.0;
  const double G = p.body_E / (2.0 * (1.0 + p.body_nu));
  const double EI = p.body_E * second_moment, GJ = 2.0 * G * second_moment;
  const double EA = p.body_E * area, GA = p.body_shear_factor * G * area;
  const double rotary = p.body_rho * second_moment;
  const std::array<double, 6> solid{EI, EI, GJ, GA, GA, EA};
  const Triple& curvature = p.body_curvature;
  return {.stiffness = p.body_profile == Profile::round ? solid : p.body_stiffness,
          .retardation = p.body_retardation,
          .mass = p.body_rho * area,
          .inertia = {rotary, rotary, 2.0 * rotary},
          .reference = {curvature[0], curvature[1], curvature[2], 0.0, 0.0, 1.0}};
}

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

}  // namespace

Rod::Rod(const Parameters& p, const Section& section)
    : length_(p.body_length),
      terms_(p.order + 1),
      components_(components_of(p.strains)),
      section_(section),
      law_(p),
      closure_(p.closure) {
  const Quadrature& grid = quadrature();
  stiffness_.resize(unknowns());
  int at = 0;
  for (int a = 0; a < terms_; ++a)
    for (int c : components_)  // int P_a^2 = 1/(2a + 1); curvatures are kept times L
      stiffness_[at++] = section.stiffness[c] * (c < 3 ? 1.0 / length_ : length_) / (2 * a + 1);
  damping_ = section.retardation * stiffness_;

  for (std::size_t i = 0; i < tca_count; ++i) {
    Lane lengths;
    for (int k = 0; k < nodes; ++k) {
      const double angle = p.tca_azimuth[i] + p.tca_helix[i] * length_ * grid.s[k];
      const Vec3 direction{std::cos(angle), std::sin(angle), 0.0};
      const Vec3 r = (p.tca_offset / length_) * direction;
      const Vec3 slope = (p.tca_helix[i] * p.tca_offset) * Vec3{-direction.y, direction.x, 0.0};
      offset_[i].put(k, r);
      slope_[i].put(k, slope);
      const Vec3 kappa = length_ * Vec3{section.reference[0], section.reference[1], section.reference[2]};
      const Vec3 lambda{section.reference[3], section.reference[4], section.reference[5]};
      const Vec3 u = lambda + cross(kappa, r) + slope;
      lengths[k] = std::sqrt(dot(u, u));
    }
    reference_length_[i] = total(grid.w, lengths);
  }
}

double Rod::first_frequency() const {
  const double EI = std::min(section_.stiffness[0], section_.stiffness[1]);
  return 3.516 * std::sqrt(EI / section_.mass) / (length_ * length_);
}

void Rod::expand(const double* coefficients, Strain& strain) const {
  const Quadrature& grid = quadrature();
  strain = Strain{};
  for (int a = 0; a < terms_; ++a)
    for (int c : components_) {
      Lane& out = lane(c < 3 ? strain.kappa : strain.lambda, c % 3);
      const double factor = *coefficients++;
      for (int p = 0; p < packs; ++p) out.pack[p] += factor * grid.legendre[a].pack[p];
    }
}

void Rod::rotations(const double* q, Work& work) const {
  const Quadrature& grid = quadrature();
  IntervalCurvature kappa;
  for (int g = 0; g < points; ++g)
    for (int c = 0; c < 3; ++c)
      for (int p = 0; p < interval_packs; ++p) kappa[g][c].pack[p] = Pack{} + length_ * section_.reference[c];
  for (int a = 0; a < terms_; ++a)
    for (int c : components_) {
      const double factor = *q++;
      if (c < 3)
        for (int g = 0; g < points; ++g)
          for (int p = 0; p < interval_packs; ++p) kappa[g][c].pack[p] += factor * grid.legendre_between[a][g].pack[p];
    }
  work.tip_quaternion = rotate_along(kappa, work.R);
}

namespace {

/// u_i, its direction and arm at all nodes; returns |u_i|.
ROD_INLINE void tca_geometry(const Field& kappa, const Field& lambda, const Field& offset, const Field& slope,
                             Lane& length, Lane& inverse, Field& t, Field& arm) {
  for (int p = 0; p < packs; ++p) {
    const Triad<Pack> u = lambda[p] + cross(kappa[p], offset[p]) + slope[p];
    const Pack square = dot(u, u);
    for (int k = 0; k < pack_size; ++k) length.pack[p][k] = std::sqrt(square[k]);
    inverse.pack[p] = 1.0 / length.pack[p];
    const Triad<Pack> direction = inverse.pack[p] * u;
    t.set(p, direction);
    arm.set(p, cross(offset[p], direction));
  }
}

ROD_INLINE void static_loads(const Quadrature& grid, const Field& lambda, double mass_length_2, double length,
                             const Loads& loads, Work& w, Field& couple, Field& force) {
  const Vec3 weight = mass_length_2 * loads.gravity;
  for (int p = 0; p < packs; ++p) {
    const Rotation<Pack> R = w.R[p];
    const Triad<Pack> l = R * lambda[p];
    w.l.set(p, l);
    const Triad<Pack> n = spread(length * loads.tip_force) + (1.0 - grid.s.pack[p]) * spread(weight);
    w.n.set(p, n);
    w.m.set(p, cross(l, n));
  }
  integrate(grid.adjoint, w.m, w.m);
  for (int p = 0; p < packs; ++p) {
    const Rotation<Pack> R = w.R[p];
    const Triad<Pack> m = w.m[p] + spread(loads.tip_moment);
    w.m.set(p, m);
    couple.set(p, back(R, m));
    force.set(p, back(R, w.n[p]));
  }
}

/// The same with inertia. mass_length = (rho A L^2, rho A L^3), inertia = rho J L.
ROD_INLINE void dynamic_loads(const Quadrature& grid, const Field& lambda, const Field& kappa1, const Field& lambda1,
                              const Field& kappa2, const Field& lambda2, double mass_length_2, double length,
                              const Vec3& inertia, const Loads& loads, Work& w, Field& couple, Field& force) {
  for (int p = 0; p < packs; ++p) {
    const Rotation<Pack> R = w.R[p];
    w.l.set(p, R * lambda[p]);
    w.k1.set(p, R * kappa1[p]);
    w.l1.set(p, R * lambda1[p]);
    w.k2.set(p, R * kappa2[p]);
    w.l2.set(p, R * lambda2[p]);
  }
  integrate(grid.forward, w.k1, w.omega);
  for (int p = 0; p < packs; ++p) {
    w.alpha.set(p, cross(w.omega[p], w.k1[p]) + w.k2[p]);
    w.velocity.set(p, cross(w.omega[p], w.l[p]) + w.l1[p]);
  }
  integrate(grid.forward, w.alpha, w.alpha);
  integrate(grid.forward, w.velocity, w.velocity);
  for (int p = 0; p < packs; ++p) {
    const Triad<Pack> omega = w.omega[p], l = w.l[p];
    w.acceleration.set(p, cross(w.alpha[p], l) + cross(omega, cross(omega, l) + 2.0 * w.l1[p]) + w.l2[p]);
  }
  integrate(grid.forward, w.acceleration, w.acceleration);
  const Vec3 weight = mass_length_2 * loads.gravity;
  for (int p = 0; p < packs; ++p) {
    const Rotation<Pack> R = w.R[p];
    const Triad<Pack> omega = back(R, w.omega[p]);
    w.omega_body.set(p, omega);
    w.hdot.set(p, R * (scale(spread(inertia), back(R, w.alpha[p])) + cross(omega, scale(spread(inertia), omega))));
    w.n.set(p, spread(weight) - (mass_length_2 * length) * w.acceleration[p]);
  }
  integrate(grid.adjoint, w.n, w.n);
  for (int p = 0; p < packs; ++p) {
    const Triad<Pack> n = w.n[p] + spread(length * loads.tip_force);
    w.n.set(p, n);
    w.m.set(p, cross(w.l[p], n) - w.hdot[p]);
  }
  integrate(grid.adjoint, w.m, w.m);
  for (int p = 0; p < packs; ++p) {
    const Rotation<Pack> R = w.R[p];
    const Triad<Pack> m = w.m[p] + spread(loads.tip_moment);
    w.m.set(p, m);
    couple.set(p, back(R, m));
    force.set(p, back(R, w.n[p]));
  }
}

ROD_INLINE void add_moments(const Quadrature& grid, int terms, const int* components, int count, const Field& couple,
                            const Field& force, double sign, double* r) {
  for (int a = 0; a < terms; ++a) {
    Lane weighted;
    for (int p = 0; p < packs; ++p) weighted.pack[p] = sign * grid.w.pack[p] * grid.legendre[a].pack[p];
    for (int i = 0; i < count; ++i) {
      const int c = components[i];
      *r++ += total(weighted, lane(c < 3 ? couple : force, c % 3));
    }
  }
}

}  // namespace

void Rod::project(const Field& couple, const Field& force, double sign, double* r) const {
  fastest<add_moments>(quadrature(), terms_, components_.data(), static_cast<int>(components_.size()), couple, force,
                       sign, r);
}

void Rod::displacements(const Strain& strain, Work& work) const {
  const Quadrature& grid = quadrature();
  for (std::size_t i = 0; i < tca_count; ++i) {
    Lane length;
    fastest<tca_geometry>(strain.kappa, strain.lambda, offset_[i], slope_[i], length, work.inverse_length[i], work.t[i],
                          work.arm[i]);
    work.delta[i] = length_ * (total(grid.w, length) - reference_length_[i]);
    work.b[i].setZero(unknowns());
    project(work.arm[i], work.t[i], length_, work.b[i].data());
  }
}

void Rod::residual(const double* q, const double* v, const double* a, const Loads& loads, Work& work, Vector& r) const {
  const Quadrature& grid = quadrature();
  Strain strain;
  expand(q, strain);
  const Vec3 kappa_0 = length_ * Vec3{section_.reference[0], section_.reference[1], section_.reference[2]};
  const Vec3 lambda_0{section_.reference[3], section_.reference[4], section_.reference[5]};
  for (int p = 0; p < packs; ++p) {
    strain.kappa.set(p, strain.kappa[p] + spread(kappa_0));
    strain.lambda.set(p, strain.lambda[p] + spread(lambda_0));
  }
  rotations(q, work);
  displacements(strain, work);

  Field couple, force;
  const double mass_length_2 = section_.mass * length_ * length_;
  work.moving = v != nullptr;
  if (work.moving) {
    Strain rates, accelerations;
    expand(v, rates);
    expand(a, accelerations);
    fastest<dynamic_loads>(grid, strain.lambda, rates.kappa, rates.lambda, accelerations.kappa, accelerations.lambda,
                           mass_length_2, length_, length_ * section_.inertia, loads, work, couple, force);
  } else {
    fastest<static_loads>(grid, strain.lambda, mass_length_2, length_, loads, work, couple, force);
  }

  const int n = unknowns();
  r = stiffness_.cwiseProduct(Eigen::Map<const Vector>(q, n));
  if (work.moving) r += damping_.cwiseProduct(Eigen::Map<const Vector>(v, n));
  project(couple, force, -1.0, r.data());
  for (std::size_t i = 0; i < tca_count; ++i) {
    const bool inside = closure_ == Closure::inside;
    work.tension[i] = law_.tension(inside ? work.delta[i] : loads.delta_guess[i], loads.T[i]);
    if (!inside) work.tension[i].per_delta = 0.0;  // the force does not follow this rod's own displacement
    r += work.tension[i].value * work.b[i];
  }
}

}  // namespace rod
