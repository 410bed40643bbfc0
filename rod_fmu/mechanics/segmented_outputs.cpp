// Outputs of a body of segments, and estimates of the error of its strain polynomials.
#include <algorithm>
#include <cmath>

#include "mechanics/polynomials.hpp"
#include "mechanics/rotations.hpp"
#include "mechanics/segmented_rod.hpp"
#include "numerics/kernel.hpp"
#include "physics/triple.hpp"

namespace rod {

void SegmentedRod::outputs(const double* q, const double* v, const Loads& loads, Workspace& work, Outputs& y,
                           unsigned parts) const {
  if (parts & part::shape) shape(work, y);
  if (parts & (part::tip_position | part::tip_orientation | part::tip_velocity)) tip_motion(work, y);
  if (parts & part::energy) energies(q, loads, work, y);
  if (parts & part::tcas) tca_outputs(v, loads, work, y);
  if (!(parts & part::out_of_plane)) return;
  y.out_of_plane = 0.0;
  if (!is_planar_) return;
  backward_at_rest(loads, work, work.balance);
  y.out_of_plane = out_of_plane(work);
}

void SegmentedRod::shape(const Workspace& work, Outputs& y) const {
  for (std::size_t m = 0; m < kShapeStations; ++m) {
    const Station& station = stations_[m];
    const SegmentWorkspace& w = work.segments[station.segment];
    const double L = parts_[station.segment].constants.length;
    VectorField rate;
    for (int p = 0; p < parts_[station.segment].constants.grid->packs; ++p)
      rate.set(p, cross(w.omega[p], w.l[p]) + w.l1[p]);
    y.shape[m] = triple(frame_.from_frame(w.base.p + L * weighted_sum(station.weights, w.l)));
    y.shape_v[m] = triple(frame_.from_frame(w.base.v + L * weighted_sum(station.weights, rate)));
  }
}

void SegmentedRod::tip_motion(const Workspace& work, Outputs& y) const {
  const SectionMotion& tip = work.segments.back().tip;
  y.tip_p = triple(frame_.from_frame(tip.p));
  y.tip_v = triple(frame_.from_frame(tip.v));
  const auto [w0, x, z1, z2] = tip.quaternion;
  // The same rotation about axes of the fixed frame: a turn of the frame leaves the scalar part and turns the vector.
  const Vec3 axis = frame_.from_frame({x, z1, z2});
  y.tip_quaternion = {w0, axis.x, axis.y, axis.z};
  y.tip_euler =
      euler_angles(rotation(y.tip_quaternion[0], y.tip_quaternion[1], y.tip_quaternion[2], y.tip_quaternion[3]));
}

void SegmentedRod::energies(const double* q, const Loads& loads, Workspace& work, Outputs& y) const {
  const SectionMotion& tip = work.segments.back().tip;
  const Vec3 gravity = frame_.to_frame(loads.gravity);
  y.energy_elastic = 0.0;
  y.energy_kinetic = tip_body_kinetic(tip_body_, tip);
  y.energy_gravity = tip_body_potential(tip_body_, tip, gravity);
  for (std::size_t j = 0; j < parts_.size(); ++j) {
    const Part& part = parts_[j];
    const Quadrature& grid = *part.constants.grid;
    const SegmentWorkspace& w = work.segments[j];
    const Eigen::Map<const Vector> own(q + part.first, part.unknowns());
    auto forces = work.balance.head(part.unknowns());
    forces.noalias() = part.stiffness * own;
    y.energy_elastic += 0.5 * own.dot(forces);
    const double L = part.constants.length;
    for (int k = 0; k < grid.nodes; ++k) {
      const Vec3 velocity = L * w.velocity.at(k), spin = w.omega_body.at(k);
      const double rotary = part.inertia.rotary[k], weight = L * grid.w[k];
      y.energy_kinetic += 0.5 * weight *
                          (part.inertia.mass[k] * dot(velocity, velocity) +
                           rotary * (spin.x * spin.x + spin.y * spin.y + 2.0 * spin.z * spin.z));
      y.energy_gravity -= L * weight * part.inertia.mass_beyond[k] * dot(gravity, w.l.at(k));  // int of g.p, by parts
    }
    y.energy_gravity -= L * part.inertia.mass_total * dot(gravity, w.base.p);
  }
  if (contact_ != Contact::bonded && ends_ != Ends::tethered) {
    y.energy_tca = tca_energy(loads, work);
    return;
  }
  y.energy_tca = 0.0;
  for (std::size_t i = 0; i < tcas(); ++i) y.energy_tca += energy_of_tca(i, loads.T[i], work);
}

double SegmentedRod::energy_of_tca(std::size_t i, double T, const Workspace& work) const {
  if (contact_ != Contact::bonded) return laws_[i].tethered_energy(work.delta[i], work.twist[i], T);
  double energy = 0.0;
  for (std::size_t j = 0; j < parts_.size(); ++j) {
    const Part& part = parts_[j];
    if (!part.constants.is_routed[i]) continue;
    for (int k = 0; k < part.constants.grid->nodes; ++k) {
      const double stretch = 1.0 / work.segments[j].inverse_length[i][k] - part.reference_length[i][k];
      energy += part.constants.grid->w[k] * part.constants.length / span_[i] * laws_[i].energy(span_[i] * stretch, T);
    }
  }
  return energy;
}

void SegmentedRod::clamp_reaction(const Loads&, const Workspace& work, Outputs& y) const {
  y.base_force = triple(frame_.from_frame(-1.0 * work.base.force));
  y.base_moment = triple(frame_.from_frame(-1.0 * work.base.moment));
}

void SegmentedRod::backward_at_rest(const Loads& loads, Workspace& work, Vector& r) const {
  for (SegmentWorkspace& w : work.segments) w.moving = false;
  backward(loads, work, r);
}

void SegmentedRod::section_balance(const Workspace& work, std::size_t j, VectorField& couple,
                                   VectorField& force) const {
  const Part& part = parts_[j];
  const RodConstants& constants = part.constants;
  const SegmentWorkspace& w = work.segments[j];
  for (int p = 0; p < constants.grid->packs; ++p) {
    const Rotation<Pack> R = w.R[p];
    couple.set(p, transpose_times(R, w.m[p]));
    force.set(p, transpose_times(R, w.n[p]));
  }
  for (std::size_t i = 0; i < tcas(); ++i) {
    if (!constants.is_routed[i]) continue;
    for (int p = 0; p < constants.grid->packs; ++p) {
      const Pack tension =
          constants.length * (contact_ == Contact::bonded ? w.N[i].pack[p] : work.tension[i].value - Pack{});
      couple.set(p, couple[p] - tension * w.arm[i][p]);
      force.set(p, force[p] - tension * w.t[i][p]);
    }
    if (contact_ != Contact::bonded && ends_ == Ends::tethered)
      subtract_torque(constants, w, i, work.tethered[i].Q, couple, force);
  }
}

double SegmentedRod::out_of_plane(const Workspace& work) const {
  double worst = 0.0;
  for (std::size_t j = 0; j < parts_.size(); ++j) {
    VectorField couple, force;
    section_balance(work, j, couple, force);
    for (int c : parts_[j].excluded)
      for (int k = 0; k < parts_[j].constants.grid->nodes; ++k)
        worst =
            std::max(worst, std::abs(component(c < 3 ? couple : force, c % 3)[k]) / parts_[j].local_stiffness[c][k]);
  }
  return worst;
}

double SegmentedRod::spatial_error(const double* q, const Loads& loads, Workspace& work) const {
  // As for a uniform rod (spatial_error.cpp), with rotation and shift carried on from segment to segment.
  backward_at_rest(loads, work, work.balance);
  PerTca<double> delta{};
  Vec3 turned{}, shifted{};
  double largest = 0.0;
  for (std::size_t j = 0; j < parts_.size(); ++j) {
    const Part& part = parts_[j];
    const RodConstants& constants = part.constants;
    const Quadrature& grid = *constants.grid;
    const SegmentWorkspace& w = work.segments[j];
    VectorField couple, force, kappa, lambda, dkappa, dlambda;
    section_balance(work, j, couple, force);
    add_expansion<kMaxPacks>(constants, q + part.first, kappa, lambda);
    for (int c : part.components) {
      const ScalarField& density = component(c < 3 ? couple : force, c % 3);
      const ScalarField& strain = component(c < 3 ? kappa : lambda, c % 3);
      ScalarField& missing = component(c < 3 ? dkappa : dlambda, c % 3);
      for (int k = 0; k < grid.nodes; ++k) missing[k] = density[k] / part.local_stiffness[c][k] - strain[k];
      for (int a = 0; a < constants.terms; ++a) {
        const double coefficient = (2 * a + 1) * weighted_sum(grid.moment[a], missing);
        for (int k = 0; k < grid.nodes; ++k) missing[k] -= coefficient * grid.legendre[a][k];
      }
    }
    NodeArray<Triad<Pack>, kMaxPacks> theta{}, shift{};
    for (int p = 0; p < grid.packs; ++p) theta[p] = w.R[p] * dkappa[p];
    VectorField density;
    for (int p = 0; p < grid.packs; ++p) density.set(p, theta[p]);
    const Vec3 turn = weighted_sum(grid.w, density);
    theta = integral(grid.forward, theta);
    for (int p = 0; p < grid.packs; ++p) shift[p] = cross(theta[p] + broadcast(turned), w.l[p]) + w.R[p] * dlambda[p];
    for (int p = 0; p < grid.packs; ++p) density.set(p, shift[p]);
    const Vec3 moved = constants.length * weighted_sum(grid.w, density);
    shift = integral(grid.forward, shift);
    for (int p = 0; p < grid.packs; ++p) {
      const Triad<Pack> at = broadcast(shifted) + constants.length * shift[p];
      const Pack square = dot(at, at);
      for (int k = 0; k < kPackSize; ++k)
        if (p * kPackSize + k < grid.nodes) largest = std::max(largest, std::sqrt(square[k]));
    }
    turned = turned + turn, shifted = shifted + moved;
    for (std::size_t i = 0; i < tcas(); ++i)
      if (constants.is_routed[i])
        for (int k = 0; k < grid.nodes; ++k)
          delta[i] +=
              constants.length * grid.w[k] * (dot(w.arm[i].at(k), dkappa.at(k)) + dot(w.t[i].at(k), dlambda.at(k)));
  }
  for (const double each : delta) largest = std::max(largest, std::abs(each));
  return largest;
}

double SegmentedRod::spatial_error(const double* q) const {
  double sum = 0.0;
  for (const Part& part : parts_)
    sum += part.constants.length * missing_share(q + part.first, part.constants.terms, part.components);
  return sum;
}

}  // namespace rod
