// Outputs of a uniform rod: pose (Eq. 5), velocity (Eq. 6), shape, displacements (Eq. 17), tensions (Eq. 4) and
// energies.
#include <algorithm>
#include <cmath>

#include "mechanics/rotations.hpp"
#include "mechanics/uniform_rod.hpp"
#include "numerics/kernel.hpp"
#include "physics/triple.hpp"

namespace rod {

namespace {

constexpr int kTip = static_cast<int>(kShapeStations) - 1;  // the last station

/// Integrals of p'/L from the clamp to each station.
struct StationSums {
  StationField x, y, z;
  Vec3 at(int m) const { return {x[m], y[m], z[m]}; }
};

struct Energies {
  double kinetic = 0.0;  // integral of twice the kinetic energy per length [J/m]
  double height = 0.0;   // integral of gravity . p/L [m/s2]
};

ROD_INLINE double total(const Pack& a) { return (a[0] + a[1]) + (a[2] + a[3]); }

/// Integrals of f to the stations from pack `first` on, each in the order of total() over packs of nodes.
ROD_INLINE void integrate_to_stations(const Quadrature& grid, const ScalarField& f, int first,
                                      StationField& integrals) {
  for (int s = first; s < kStationPacks; ++s) {
    Pack sum[kPackSize] = {};
    for (int j = 0; j < grid.nodes; j += kPackSize)
      for (int k = 0; k < kPackSize; ++k) sum[k] += f[j + k] * grid.stations.data()[j + k].pack[s];
    integrals.pack[s] = (sum[0] + sum[1]) + (sum[2] + sum[3]);
  }
}

ROD_INLINE void integrate_tangent(const RodConstants& rod, const Kinematics& w, int first, StationSums& sums) {
  const Quadrature& grid = *rod.grid;
  integrate_to_stations(grid, w.l.x, first, sums.x);
  if (!rod.planar) integrate_to_stations(grid, w.l.y, first, sums.y);
  integrate_to_stations(grid, w.l.z, first, sums.z);
}

/// Integral of the rate of p'/L over the rod [1/s].
ROD_INLINE Vec3 tip_rate(const RodConstants& rod, const Kinematics& w) {
  const Quadrature& grid = *rod.grid;
  Pack x{}, y{}, z{};
  for (int p = 0; p < grid.packs; ++p) {
    const Pack weight = grid.w.pack[p];
    const Triad<Pack> rate = cross(w.omega[p], w.l[p]) + w.l1[p];
    x += weight * rate.x, y += weight * rate.y, z += weight * rate.z;
  }
  return {total(x), total(y), total(z)};
}

ROD_INLINE Energies energies(const RodConstants& rod, const Vec3& gravity, const Kinematics& w) {
  const Quadrature& grid = *rod.grid;
  Pack kinetic{}, height{};
  for (int p = 0; p < grid.packs; ++p) {
    const Pack weight = grid.w.pack[p];
    const Triad<Pack> velocity = rod.length * w.velocity[p], spin = w.omega_body[p];
    kinetic += weight * (rod.mass * dot(velocity, velocity) + dot(spin, scale(rod.inertia, spin)));
    height += weight * ((1.0 - grid.s.pack[p]) * dot(gravity, w.l[p]));  // int_0^L g.p ds by parts
  }
  return {total(kinetic), total(height)};
}

}  // namespace

Triple euler_angles(const Rotation<double>& R) {
  const double sine = std::clamp(R.row0.z, -1.0, 1.0);
  if (std::hypot(R.row0.x, R.row0.y) < 1e-12) return {std::atan2(R.row2.y, R.row1.y), std::asin(sine), 0.0};
  return {std::atan2(-R.row1.z, R.row2.z), std::atan2(sine, std::hypot(R.row0.x, R.row0.y)),
          std::atan2(-R.row0.y, R.row0.x)};
}

void UniformRod::outputs(const double* q, const double* v, const Loads& loads, Workspace& w, Outputs& y,
                         unsigned parts) const {
  if (parts & (part::tip_position | part::shape)) {
    const bool is_whole = parts & part::shape;
    StationSums sums;
    dispatch_exact<integrate_tangent>(constants_, w, is_whole ? 0 : kTip / kPackSize, sums);
    const auto position = [&](int m) { return triple(length() * frame_.from_frame(sums.at(m))); };
    for (int m = 0; is_whole && m <= kTip; ++m) y.shape.data()[m] = position(m);
    if (parts & part::tip_position) y.tip_p = position(kTip);
  }
  if (parts & part::tip_orientation) {
    y.tip_quaternion = w.tip_quaternion;
    if (constants_.planar) {
      const double half = 0.5 * (q[0] + constants_.kappa.y);  // polynomials of higher degree do not turn the tip
      y.tip_quaternion = {std::cos(half), -frame_.sine * std::sin(half), frame_.cosine * std::sin(half), 0.0};
    }
    y.tip_euler =
        euler_angles(rotation(y.tip_quaternion[0], y.tip_quaternion[1], y.tip_quaternion[2], y.tip_quaternion[3]));
  }
  if (parts & part::tip_velocity)
    y.tip_v = triple(length() * frame_.from_frame(dispatch_exact<tip_rate>(constants_, w)));
  if (parts & part::energy) {
    const Energies sums = dispatch_exact<energies>(constants_, frame_.to_frame(loads.gravity), w);
    y.energy_elastic = 0.5 * stiffness_.dot(Eigen::Map<const Vector>(q, unknowns()).cwiseAbs2());
    y.energy_kinetic = 0.5 * length() * sums.kinetic;
    y.energy_gravity = -section_.mass * length() * length() * sums.height;
    y.energy_tca = has_slack_tcas_ ? 0.0 : tca_energy(loads, w);
  }
  if (parts & part::tcas) tca_outputs(v, loads, w, y);
  if (parts & part::out_of_plane) y.out_of_plane = constants_.planar ? out_of_plane(loads, w) : 0.0;
}

void UniformRod::clamp_reaction(const Loads& loads, const Workspace& w, Outputs& y) const {
  const Quadrature& grid = *constants_.grid;
  const BodyLoads turned = loads.seen_from(frame_);
  const double L = length(), mass = section_.mass * L;
  Vec3 force = turned.tip_force + mass * turned.gravity, moment = turned.tip_moment;
  for (int k = 0; k < grid.nodes; ++k) {
    moment = moment + grid.w[k] * cross(w.l.at(k), w.n.at(k));
    if (!w.moving) continue;
    const Vec3 swing = cross(w.alpha.at(k), w.l.at(k)) + cross(w.omega.at(k), w.swing.at(k)) + w.l2.at(k);
    force = force - (mass * L * grid.w[k] * (1.0 - grid.s[k])) * swing;  // int of the acceleration, by parts
    moment = moment - grid.w[k] * w.hdot.at(k);
  }
  y.base_force = triple(frame_.from_frame(-1.0 * force));
  y.base_moment = triple(frame_.from_frame(-1.0 * moment));
}

double UniformRod::out_of_plane(const Loads& loads, const Workspace& w) const {
  // The balance of a section again, now of the components that the plane leaves out, at the strains of the plane.
  const Quadrature& grid = *constants_.grid;
  const BodyLoads turned = loads.seen_from(frame_);
  const double weight = constants_.mass * length() * length() * turned.gravity.y;
  const bool is_pulled = std::any_of(w.tension.begin(), w.tension.begin() + static_cast<std::ptrdiff_t>(acting_.tcas),
                                     [](const Tension& each) { return each.value != 0.0; });
  if (!is_pulled && weight == 0.0 && turned.tip_force.y == 0.0 && turned.tip_moment.x == 0.0 &&
      turned.tip_moment.z == 0.0)
    return 0.0;
  NodeArray<Triad<Pack>, kMaxPacks> n{}, m{};
  if (turned.gravity.y != 0.0 || turned.tip_force.y != 0.0) {
    for (int p = 0; p < grid.packs; ++p) {
      n[p].y = length() * turned.tip_force.y + (1.0 - grid.s.pack[p]) * weight;
      m[p] = cross(w.l[p], n[p]);
    }
    m = integral(grid.adjoint, m);
  }
  VectorField couple, force;
  for (int p = 0; p < grid.packs; ++p) {
    couple.set(p, transpose_times(w.R[p], m[p] + broadcast({turned.tip_moment.x, 0.0, turned.tip_moment.z})));
    force.set(p, n[p]);
    for (std::size_t i = 0; i < acting_.tcas; ++i) {
      const double tension = length() * w.tension[i].value;
      couple.set(p, couple[p] - tension * w.arm[i][p]);
      force.set(p, force[p] - tension * w.t[i][p]);
    }
  }
  double worst = 0.0;
  for (int c : excluded_components_)
    for (int k = 0; k < grid.nodes; ++k)
      worst = std::max(worst, std::abs(component(c < 3 ? couple : force, c % 3)[k]) / stiffness_per_strain(c));
  return worst;
}

}  // namespace rod
