// Residual of a body of segments: the chain of motions from the clamp to the tip, and of wrenches back.
#include <Eigen/Dense>
#include <algorithm>

#include "mechanics/polynomials.hpp"
#include "mechanics/segmented_rod.hpp"
#include "mechanics/tca_node.hpp"
#include "numerics/kernel.hpp"

namespace rod {

void subtract_torque(const RodConstants& segment, const SegmentWorkspace& w, std::size_t i, double Q,
                     VectorField& couple, VectorField& force) {
  for (int k = 0; k < segment.grid->nodes; ++k) {
    const Vector6 density = Q * twist_gradient(tca_node(segment, w, i, k));
    couple.put(k, couple.at(k) - triad(density.head<3>()));
    force.put(k, force.at(k) - triad(density.tail<3>()));
  }
}

void SegmentedRod::size(Workspace& work) const {
  const std::size_t count = tcas();
  if (work.segments.size() == parts_.size() && work.b.size() == count && work.scratch.size() == unknowns()) return;
  work.segments.resize(parts_.size());
  for (SegmentWorkspace& w : work.segments)
    for (auto* fields : {&w.t, &w.arm}) fields->resize(count);
  for (SegmentWorkspace& w : work.segments)
    for (auto* fields : {&w.inverse_length, &w.N, &w.N_stretch, &w.N_T}) fields->resize(count);
  work.b.assign(count, Vector::Zero(unknowns()));
  work.c.assign(count, Vector::Zero(unknowns()));
  work.neighbours.resize(parts_.size());
  work.scratch.resize(unknowns());
  work.balance.resize(unknowns());
}

void SegmentedRod::forward(const double* q, const double* v, const double* a, bool moving, Workspace& work) const {
  size(work);
  for (std::size_t j = 0; j < parts_.size(); ++j) {
    const Part& part = parts_[j];
    SegmentWorkspace& w = work.segments[j];
    if (j > 0) w.base = work.segments[j - 1].tip;
    Gradients b{};
    for (std::size_t i = 0; i < tcas(); ++i) b[i] = work.b[i].data() + part.first;
    part.loops.forward(part.constants, q + part.first, v ? v + part.first : nullptr, a ? a + part.first : nullptr,
                       moving, w, b);
    for (int p = 0; p < part.constants.grid->packs; ++p)
      w.kappa.set(p, broadcast(part.constants.kappa)), w.lambda.set(p, broadcast(part.constants.lambda));
    add_expansion<kMaxPacks>(part.constants, q + part.first, w.kappa, w.lambda);
  }
}

void SegmentedRod::pull(const Loads& loads, Workspace& work) const {
  for (std::size_t i = 0; i < tcas(); ++i) {
    work.delta[i] = 0.0;
    for (std::size_t j = 0; j < parts_.size(); ++j)
      if (parts_[j].constants.is_routed[i])
        work.delta[i] += parts_[j].constants.length * work.segments[j].path[i] - parts_[j].reference_path[i];
  }
  if (contact_ == Contact::bonded)
    pull_bonded(loads, work);
  else if (ends_ == Ends::tethered)
    pull_tethered(loads, work);
  else
    pull_tcas(loads, work);
}

void SegmentedRod::pull_bonded(const Loads& loads, Workspace& work) const {
  for (std::size_t i = 0; i < tcas(); ++i) {
    double mean = 0.0;
    for (std::size_t j = 0; j < parts_.size(); ++j) {
      const Part& part = parts_[j];
      if (!part.constants.is_routed[i]) continue;
      SegmentWorkspace& w = work.segments[j];
      for (int k = 0; k < part.constants.grid->nodes; ++k) {
        const double stretch = 1.0 / w.inverse_length[i][k] - part.reference_length[i][k];
        const Tension tension = laws_[i].tension(span_[i] * stretch, loads.T[i]);
        w.N[i][k] = tension.value;
        w.N_stretch[i][k] = span_[i] * tension.per_delta;
        w.N_T[i][k] = tension.per_T;
        mean +=
            part.constants.grid->w[k] * part.constants.length * part.reference_length[i][k] / span_[i] * tension.value;
      }
    }
    work.tension[i] = {mean, 0.0, 0.0};
  }
}

void SegmentedRod::pull_tethered(const Loads& loads, Workspace& work) const {
  for (std::size_t i = 0; i < tcas(); ++i) {
    work.twist[i] = 0.0;
    for (std::size_t j = 0; j < parts_.size(); ++j) {
      const Part& part = parts_[j];
      const RodConstants& constants = part.constants;
      if (!constants.is_routed[i]) continue;
      const SegmentWorkspace& w = work.segments[j];
      auto c = work.c[i].segment(part.first, part.unknowns());
      c.setZero();
      work.twist[i] -= part.reference_twist[i];
      for (int k = 0; k < constants.grid->nodes; ++k) {
        const TcaNode node = tca_node(constants, w, i, k);
        work.twist[i] += constants.grid->w[k] * node.kappa.dot(node.t);
        const Vector6 gradient = twist_gradient(node);
        for (int a = 0; a < constants.terms; ++a)
          for (int e = 0; e < constants.count; ++e)
            c[a * constants.count + e] += constants.grid->moment[a][k] * gradient[part.components[e]];
      }
    }
    work.tethered[i] = laws_[i].tethered(work.delta[i], work.twist[i], loads.T[i]);
    work.tension[i] = {work.tethered[i].N, 0.0, 0.0};
  }
}

void SegmentedRod::add_body_and_tcas(const double* q, const Workspace& work, Vector& r) const {
  for (std::size_t j = 0; j < parts_.size(); ++j) {
    const Part& part = parts_[j];
    const int n = part.unknowns();
    r.segment(part.first, n).noalias() += part.stiffness * Eigen::Map<const Vector>(q + part.first, n);
    if (contact_ != Contact::bonded) continue;
    const RodConstants& constants = part.constants;
    const SegmentWorkspace& w = work.segments[j];
    VectorField couple, force;
    for (std::size_t i = 0; i < tcas(); ++i) {
      if (!constants.is_routed[i]) continue;
      for (int p = 0; p < constants.grid->packs; ++p) {
        const Pack tension = constants.length * w.N[i].pack[p];
        couple.set(p, couple[p] + tension * w.arm[i][p]);
        force.set(p, force[p] + tension * w.t[i][p]);
      }
    }
    project<kMaxPacks>(constants, couple, force, 1.0, work.scratch.data());
    r.segment(part.first, n) += work.scratch.head(n);
  }
  if (contact_ == Contact::bonded) return;
  for (std::size_t i = 0; i < tcas(); ++i) {
    r += work.tension[i].value * work.b[i];
    if (ends_ == Ends::tethered) r += work.tethered[i].Q * work.c[i];
  }
}

SegmentLoads SegmentedRod::segment_loads(const Part& part, const BodyLoads& turned, const Loads& loads,
                                         const Wrench& end) const {
  SegmentLoads own{.gravity = turned.gravity, .end = end, .along = {}, .along_total = {}};
  if (!has_load_) return own;
  for (std::size_t m = 0; m < kShapeStations; ++m) {
    const Vec3 force = frame_.to_frame(loads.load[m]);
    own.along_total = own.along_total + part.hat_total[m] * force;
    for (int p = 0; p < part.constants.grid->packs; ++p)
      own.along.set(p, own.along[p] + part.hat[m].pack[p] * broadcast(force));
  }
  return own;
}

Wrench SegmentedRod::end_wrench(const Workspace& work, const BodyLoads& turned) const {
  const SegmentWorkspace& last = work.segments.back();
  const Wrench body = tip_body_wrench(tip_body_, last.tip, turned.gravity, last.moving);
  return {turned.tip_force + body.force, turned.tip_moment + body.moment};
}

void SegmentedRod::backward(const Loads& loads, Workspace& work, Vector& r) const {
  const BodyLoads turned = loads.seen_from(frame_);
  work.gravity = turned.gravity;
  Wrench end = end_wrench(work, turned);
  for (std::size_t j = parts_.size(); j-- > 0;) {
    const Part& part = parts_[j];
    SegmentWorkspace& w = work.segments[j];
    end = part.loops.backward(part.constants, segment_loads(part, turned, loads, end), w, &w, r.data() + part.first);
  }
  work.base = end;
}

void SegmentedRod::residual(const double* q, const double* v, const double* a, const Loads& loads, Workspace& work,
                            Vector& r) const {
  ++work.evaluations;
  r.resize(unknowns());
  forward(q, v, a, true, work);
  pull(loads, work);
  backward(loads, work, r);
  add_body_and_tcas(q, work, r);
  for (const Part& part : parts_) {
    const int n = part.unknowns();
    if (part.retardation != 0.0)
      r.segment(part.first, n).noalias() +=
          part.retardation * (part.stiffness * Eigen::Map<const Vector>(v + part.first, n));
  }
}

void SegmentedRod::static_residual(const double* q, const Loads& loads, Workspace& work, Vector& r) const {
  ++work.evaluations;
  r.resize(unknowns());
  forward(q, nullptr, nullptr, false, work);
  pull(loads, work);
  backward(loads, work, r);
  add_body_and_tcas(q, work, r);
}

void SegmentedRod::kinematics(const double* q, const double* v, const Loads& loads, Workspace& work,
                              unsigned stages) const {
  if (!stages) return;
  forward(q, v, nullptr, true, work);
  pull(loads, work);
}

/// One loop makes all of them.
unsigned SegmentedRod::stages_of(unsigned parts) const {
  const bool needs_none = (parts & ~part::out_of_plane) == 0 && !is_planar_;
  return needs_none ? 0 : stage::all;
}

}  // namespace rod
