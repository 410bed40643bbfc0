// Construction and the residual. Sources: Boyer et al. (2021) and Mathew et al. (2023) for strain-parametrised rods;
// the integrals in the fixed frame (omega' = R kappa., p.' = omega x p' + R lambda.) replace their recursions on SE(3).
#include "rod.hpp"

#include <cmath>
#include <numbers>

#include "kernel.hpp"

namespace rod {

Section Section::round(const Parameters& p) {
  const double area = std::numbers::pi * p.body_radius * p.body_radius;
  const double second_moment = area * p.body_radius * p.body_radius / 4.0;
  const double G = p.body_E / (2.0 * (1.0 + p.body_nu));
  const double EI = p.body_E * second_moment, GJ = 2.0 * G * second_moment;
  const double EA = p.body_E * area, GA = p.body_shear_factor * G * area;
  const double rotary = p.body_rho * second_moment;
  return {.stiffness = {EI, EI, GJ, GA, GA, EA},
          .retardation = p.body_retardation,
          .mass = p.body_rho * area,
          .inertia = {rotary, rotary, 2.0 * rotary}};
}

namespace {

double value(const Polynomial& u, double s) { return u[0] + s * (u[1] + s * (u[2] / 2.0 + s * u[3] / 6.0)); }
double rate(const Polynomial& u, double s) { return u[1] + s * (u[2] + s * u[3] / 2.0); }

template <class Evaluate>
Loads collect(const Inputs& u, Evaluate at) {
  Loads loads;
  for (int c = 0; c < 3; ++c) {
    loads.gravity[c] = at(u.gravity[c]);
    loads.tip_force[c] = at(u.tip_force[c]);
    loads.tip_moment[c] = at(u.tip_moment[c]);
  }
  for (std::size_t i = 0; i < tca_count; ++i) {
    loads.T[i] = at(u.T[i]);
    loads.delta_guess[i] = at(u.delta_guess[i]);
  }
  return loads;
}

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

Loads loads_at(const Inputs& u, double elapsed) {
  return collect(u, [elapsed](const Polynomial& p) { return value(p, elapsed); });
}

Loads load_rates_at(const Inputs& u, double elapsed) {
  return collect(u, [elapsed](const Polynomial& p) { return rate(p, elapsed); });
}

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
      offset_[i].set(k, r);
      slope_[i].set(k, slope);
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
      for (int k = 0; k < nodes; ++k) out[k] += factor * grid.legendre[a][k];
    }
}

namespace {

struct Quaternion {
  double w, x, y, z;
};

Quaternion operator*(const Quaternion& a, const Quaternion& b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

ROD_INLINE Mat3 matrix(double w, double x, double y, double z) {
  return {{1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)},
          {2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)},
          {2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)}};
}

/// cos and sin(t)/t of t = sqrt(square), by their series where it converges to rounding within ten terms.
ROD_INLINE void half_angle(double square, double& cosine, double& sinc) {
  cosine = sinc = 1.0;
  for (int n = 10; n > 0; --n) {
    cosine = 1.0 - cosine * square / ((2 * n - 1) * (2 * n));
    sinc = 1.0 - sinc * square / ((2 * n) * (2 * n + 1));
  }
}

/// Rotation vector over an interval of length h from the curvature at its three Gauss points: Magnus expansion of order
/// 6 (Blanes, Casas, Ros 2000), for R' = R kappa^, whose bracket is [a, b] = b x a.
ROD_INLINE Vec3 magnus(double h, const Vec3& k1, const Vec3& k2, const Vec3& k3) {
  const Vec3 a1 = h * k2;
  const Vec3 a2 = (std::sqrt(15.0) / 3.0 * h) * (k3 - k1);
  const Vec3 a3 = (10.0 / 3.0 * h) * (k3 - 2.0 * k2 + k1);
  const Vec3 c1 = cross(a2, a1);
  const Vec3 c2 = (-1.0 / 60.0) * cross(2.0 * a3 + c1, a1);
  return a1 + (1.0 / 12.0) * a3 + (1.0 / 240.0) * cross(a2 + c2, -20.0 * a1 - a3 + c1);
}

constexpr double series_limit = 1.0;  // of the half angle squared

/// Rotation vectors over all intervals, as unit quaternions by component.
ROD_KERNEL void interval_quaternions(const std::array<std::array<std::array<double, intervals>, 3>, points>& kappa,
                                     const std::array<double, intervals>& h,
                                     std::array<std::array<double, intervals>, 4>& q) {
  double widest = 0.0;
  for (int e = 0; e < intervals; ++e) {
    const Vec3 k1{kappa[0][0][e], kappa[0][1][e], kappa[0][2][e]};
    const Vec3 k2{kappa[1][0][e], kappa[1][1][e], kappa[1][2][e]};
    const Vec3 k3{kappa[2][0][e], kappa[2][1][e], kappa[2][2][e]};
    const Vec3 half = 0.5 * magnus(h[e], k1, k2, k3);
    const double square = dot(half, half);
    double sinc;
    half_angle(square, q[0][e], sinc);
    q[1][e] = sinc * half.x, q[2][e] = sinc * half.y, q[3][e] = sinc * half.z;
    widest = square > widest ? square : widest;
  }
  if (widest < series_limit) return;
  for (int e = 0; e < intervals; ++e) {
    const Vec3 half = 0.5 * magnus(h[e], {kappa[0][0][e], kappa[0][1][e], kappa[0][2][e]},
                                   {kappa[1][0][e], kappa[1][1][e], kappa[1][2][e]},
                                   {kappa[2][0][e], kappa[2][1][e], kappa[2][2][e]});
    const double angle = std::sqrt(dot(half, half));
    const double sinc = angle > 1e-4 ? std::sin(angle) / angle : 1.0 - angle * angle / 6.0;
    q[0][e] = std::cos(angle), q[1][e] = sinc * half.x, q[2][e] = sinc * half.y, q[3][e] = sinc * half.z;
  }
}

ROD_KERNEL void rotation_matrices(const std::array<std::array<double, nodes>, 4>& q, RotationField& R) {
  for (int k = 0; k < nodes; ++k) R.set(k, matrix(q[0][k], q[1][k], q[2][k], q[3][k]));
}

}  // namespace

void Rod::rotations(const double* q, Work& work) const {
  const Quadrature& grid = quadrature();
  std::array<std::array<std::array<double, intervals>, 3>, points> kappa;
  for (auto& point : kappa)
    for (int c = 0; c < 3; ++c) point[c].fill(length_ * section_.reference[c]);
  for (int a = 0; a < terms_; ++a)
    for (int c : components_) {
      const double factor = *q++;
      if (c < 3)
        for (int g = 0; g < points; ++g)
          for (int e = 0; e < intervals; ++e) kappa[g][c][e] += factor * grid.legendre_between[a][g][e];
    }
  std::array<std::array<double, intervals>, 4> turns;
  interval_quaternions(kappa, grid.length, turns);

  std::array<std::array<double, nodes>, 4> at_nodes;
  Quaternion here{1.0, 0.0, 0.0, 0.0};
  for (int e = 0; e < intervals; ++e) {
    here = here * Quaternion{turns[0][e], turns[1][e], turns[2][e], turns[3][e]};
    if (e < nodes) at_nodes[0][e] = here.w, at_nodes[1][e] = here.x, at_nodes[2][e] = here.y, at_nodes[3][e] = here.z;
  }
  rotation_matrices(at_nodes, work.R);
  const double norm = std::sqrt(here.w * here.w + here.x * here.x + here.y * here.y + here.z * here.z);
  work.tip_quaternion = {here.w / norm, here.x / norm, here.y / norm, here.z / norm};
  work.tip_R = matrix(work.tip_quaternion[0], work.tip_quaternion[1], work.tip_quaternion[2], work.tip_quaternion[3]);
}

namespace {

/// u_i, its direction and arm at all nodes; returns |u_i|.
ROD_KERNEL void tca_geometry(const Field& kappa, const Field& lambda, const Field& offset, const Field& slope,
                             Lane& length, Lane& inverse, Field& t, Field& arm) {
  for (int k = 0; k < nodes; ++k) {
    const Vec3 u = lambda[k] + cross(kappa[k], offset[k]) + slope[k];
    length[k] = std::sqrt(dot(u, u));
    inverse[k] = 1.0 / length[k];
    const Vec3 direction = inverse[k] * u;
    t.set(k, direction);
    arm.set(k, cross(offset[k], direction));
  }
}

ROD_KERNEL void static_loads(const Quadrature& grid, const Field& lambda, double mass_length_2, double length,
                             const Loads& loads, Work& w, Field& couple, Field& force) {
  const Vec3 weight = mass_length_2 * loads.gravity;
  for (int k = 0; k < nodes; ++k) {
    const Mat3 R = w.R[k];
    const Vec3 l = R * lambda[k];
    w.l.set(k, l);
    const Vec3 n = length * loads.tip_force + (1.0 - grid.s[k]) * weight;
    w.n.set(k, n);
    w.m.set(k, cross(l, n));
  }
  integrate(grid.adjoint, w.m, w.m);
  for (int k = 0; k < nodes; ++k) {
    const Mat3 R = w.R[k];
    const Vec3 m = w.m[k] + loads.tip_moment;
    w.m.set(k, m);
    couple.set(k, back(R, m));
    force.set(k, back(R, w.n[k]));
  }
}

/// The same with inertia. mass_length = (rho A L^2, rho A L^3), inertia = rho J L.
ROD_KERNEL void dynamic_loads(const Quadrature& grid, const Field& lambda, const Field& kappa1, const Field& lambda1,
                              const Field& kappa2, const Field& lambda2, double mass_length_2, double length,
                              const Vec3& inertia, const Loads& loads, Work& w, Field& couple, Field& force) {
  for (int k = 0; k < nodes; ++k) {
    const Mat3 R = w.R[k];
    w.l.set(k, R * lambda[k]);
    w.k1.set(k, R * kappa1[k]);
    w.l1.set(k, R * lambda1[k]);
    w.k2.set(k, R * kappa2[k]);
    w.l2.set(k, R * lambda2[k]);
  }
  integrate(grid.forward, w.k1, w.omega);
  for (int k = 0; k < nodes; ++k) {
    w.alpha.set(k, cross(w.omega[k], w.k1[k]) + w.k2[k]);
    w.velocity.set(k, cross(w.omega[k], w.l[k]) + w.l1[k]);
  }
  integrate(grid.forward, w.alpha, w.alpha);
  integrate(grid.forward, w.velocity, w.velocity);
  for (int k = 0; k < nodes; ++k) {
    const Vec3 omega = w.omega[k], l = w.l[k];
    w.acceleration.set(k, cross(w.alpha[k], l) + cross(omega, cross(omega, l) + 2.0 * w.l1[k]) + w.l2[k]);
  }
  integrate(grid.forward, w.acceleration, w.acceleration);
  const Vec3 weight = mass_length_2 * loads.gravity;
  for (int k = 0; k < nodes; ++k) {
    const Mat3 R = w.R[k];
    const Vec3 omega = back(R, w.omega[k]);
    w.omega_body.set(k, omega);
    w.hdot.set(k, R * (scale(inertia, back(R, w.alpha[k])) + cross(omega, scale(inertia, omega))));
    w.n.set(k, weight - (mass_length_2 * length) * w.acceleration[k]);
  }
  integrate(grid.adjoint, w.n, w.n);
  for (int k = 0; k < nodes; ++k) {
    const Vec3 n = w.n[k] + length * loads.tip_force;
    w.n.set(k, n);
    w.m.set(k, cross(w.l[k], n) - w.hdot[k]);
  }
  integrate(grid.adjoint, w.m, w.m);
  for (int k = 0; k < nodes; ++k) {
    const Mat3 R = w.R[k];
    const Vec3 m = w.m[k] + loads.tip_moment;
    w.m.set(k, m);
    couple.set(k, back(R, m));
    force.set(k, back(R, w.n[k]));
  }
}

ROD_KERNEL void add_moments(const Quadrature& grid, int terms, const int* components, int count, const Field& couple,
                            const Field& force, double sign, double* r) {
  for (int a = 0; a < terms; ++a) {
    Lane weighted;
    for (int k = 0; k < nodes; ++k) weighted[k] = sign * grid.w[k] * grid.legendre[a][k];
    for (int p = 0; p < count; ++p) {
      const int c = components[p];
      const Lane& f = lane(c < 3 ? couple : force, c % 3);
      double sum = 0.0;
      for (int k = 0; k < nodes; ++k) sum += weighted[k] * f[k];
      *r++ += sum;
    }
  }
}

}  // namespace

void Rod::project(const Field& couple, const Field& force, double sign, double* r) const {
  add_moments(quadrature(), terms_, components_.data(), static_cast<int>(components_.size()), couple, force, sign, r);
}

void Rod::displacements(const Strain& strain, Work& work) const {
  const Quadrature& grid = quadrature();
  for (std::size_t i = 0; i < tca_count; ++i) {
    Lane length;
    tca_geometry(strain.kappa, strain.lambda, offset_[i], slope_[i], length, work.inverse_length[i], work.t[i],
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
  for (int k = 0; k < nodes; ++k) {
    strain.kappa.set(
        k, strain.kappa[k] + length_ * Vec3{section_.reference[0], section_.reference[1], section_.reference[2]});
    strain.lambda.set(k, strain.lambda[k] + Vec3{section_.reference[3], section_.reference[4], section_.reference[5]});
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
    dynamic_loads(grid, strain.lambda, rates.kappa, rates.lambda, accelerations.kappa, accelerations.lambda,
                  mass_length_2, length_, length_ * section_.inertia, loads, work, couple, force);
  } else {
    static_loads(grid, strain.lambda, mass_length_2, length_, loads, work, couple, force);
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
