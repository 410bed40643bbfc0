// What the world sees of a rod: pose, shape, displacements and energies.
#include <algorithm>
#include <cmath>

#include "kernel.hpp"
#include "rod.hpp"
#include "rotations.hpp"

namespace rod {

namespace {

Triple triple(const Vec3& a) { return {a.x, a.y, a.z}; }

}  // namespace

Triple euler_angles(const Rotation<double>& R) {
  const double sine = std::clamp(R.row0.z, -1.0, 1.0);
  if (std::hypot(R.row0.x, R.row0.y) < 1e-12) return {std::atan2(R.row2.y, R.row1.y), std::asin(sine), 0.0};
  return {std::atan2(-R.row1.z, R.row2.z), std::atan2(sine, std::hypot(R.row0.x, R.row0.y)),
          std::atan2(-R.row0.y, R.row0.x)};
}

void Rod::outputs(const double* q, const double* v, const Loads& loads, const Work& w, Outputs& y) const {
  const Quadrature& grid = quadrature();
  const int n = unknowns();
  const Eigen::Map<const Vector> strains(q, n), rates(v, n);

  for (std::size_t m = 0; m < shape_stations; ++m) y.shape[m] = triple(length_ * total(grid.stations[m], w.l));
  y.tip_p = y.shape.back();
  y.tip_quaternion = w.tip_quaternion;
  y.tip_euler =
      euler_angles(rotation(w.tip_quaternion[0], w.tip_quaternion[1], w.tip_quaternion[2], w.tip_quaternion[3]));
  Field tip_rate;
  for (int p = 0; p < packs; ++p) tip_rate.set(p, cross(w.omega[p], w.l[p]) + w.l1[p]);
  y.tip_v = triple(length_ * total(grid.w, tip_rate));

  y.energy_elastic = 0.5 * stiffness_.dot(strains.cwiseAbs2());
  Lane kinetic, height;
  for (int k = 0; k < nodes; ++k) {
    const Vec3 velocity = length_ * w.velocity.at(k), spin = w.omega_body.at(k);
    kinetic[k] = section_.mass * dot(velocity, velocity) + dot(spin, scale(section_.inertia, spin));
    height[k] = (1.0 - grid.s[k]) * dot(loads.gravity, w.l.at(k));  // int_0^L g.p ds by parts
  }
  y.energy_kinetic = 0.5 * length_ * total(grid.w, kinetic);
  y.energy_gravity = -section_.mass * length_ * length_ * total(grid.w, height);
  y.energy_tca = 0.0;
  for (std::size_t i = 0; i < tca_count; ++i) {
    y.delta[i] = w.delta[i];
    y.delta_rate[i] = w.b[i].dot(rates);
    y.N[i] = w.tension[i].value;
    y.energy_tca += law_.energy(closure_ == Closure::inside ? w.delta[i] : loads.delta_guess[i], loads.T[i]);
  }
}

}  // namespace rod
