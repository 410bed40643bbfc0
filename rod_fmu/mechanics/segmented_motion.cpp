// Residual and exact derivatives of a body of segments: the chain from the clamp to the tip and back.
#include <Eigen/Dense>
#include <algorithm>

#include "mechanics/polynomials.hpp"
#include "mechanics/segmented_rod.hpp"
#include "numerics/kernel.hpp"

namespace rod {

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector12 = Eigen::Matrix<double, 12, 1>;

Eigen::Vector3d dense(const Vec3& a) { return {a.x, a.y, a.z}; }
Vec3 triad(const Eigen::Vector3d& a) { return {a[0], a[1], a[2]}; }

Vector6 dense(const Wrench& w) { return (Vector6() << dense(w.force), dense(w.moment)).finished(); }
Wrench wrench(const Vector6& a) { return {triad(a.head<3>()), triad(a.tail<3>())}; }
Vector12 dense(const SectionVariation& d) {
  return (Vector12() << dense(d.theta), dense(d.omega), dense(d.alpha), dense(d.a)).finished();
}
SectionVariation variation(const Vector12& a) {
  return {triad(a.segment<3>(0)), triad(a.segment<3>(3)), triad(a.segment<3>(6)), triad(a.segment<3>(9))};
}

/// The strain of a TCA at a node: du = D e for a variation e of the section's strains in units of the unknowns.
struct TcaNode {
  Eigen::Matrix<double, 3, 6> D;
  Eigen::Vector3d t, kappa;  // direction; curvature times length
  double inverse_length;     // 1/|u|
};

TcaNode tca_node(const RodConstants& segment, const SegmentWorkspace& w, std::size_t i, int k) {
  const Vec3 r = segment.offset[i].at(k);
  TcaNode node;
  node.D << 0.0, r.z, -r.y, 1.0, 0.0, 0.0,  //
      -r.z, 0.0, r.x, 0.0, 1.0, 0.0,        //
      r.y, -r.x, 0.0, 0.0, 0.0, 1.0;
  node.t = dense(w.t[i].at(k));
  node.kappa = dense(w.kappa.at(k));
  node.inverse_length = w.inverse_length[i][k];
  return node;
}

/// Gradient of kappa . t in e.
Vector6 twist_gradient(const TcaNode& node) {
  const Eigen::Vector3d across = node.kappa - node.t * node.t.dot(node.kappa);
  Vector6 gradient = node.inverse_length * node.D.transpose() * across;
  gradient.head<3>() += node.t;
  return gradient;
}

/// Second derivative of kappa . t in e.
Matrix6 twist_hessian(const TcaNode& node) {
  const Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() - node.t * node.t.transpose();
  const Eigen::Vector3d across = normal * node.kappa;
  Matrix6 hessian = Matrix6::Zero();
  const Eigen::Matrix<double, 3, 6> turned = node.inverse_length * normal * node.D;
  hessian.topRows<3>() += turned;
  hessian.leftCols<3>() += turned.transpose();
  const Eigen::Matrix3d inner =
      node.t * across.transpose() + across * node.t.transpose() + node.t.dot(node.kappa) * normal;
  hessian -= node.inverse_length * node.inverse_length * node.D.transpose() * inner * node.D;
  return hessian;
}

/// Second derivative of |u| in e.
Matrix6 length_hessian(const TcaNode& node) {
  const Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() - node.t * node.t.transpose();
  return node.inverse_length * node.D.transpose() * normal * node.D;
}

}  // namespace

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

void SegmentedRod::kinematics(const double* q, const double* v, const Loads& loads, Workspace& work) const {
  forward(q, v, nullptr, true, work);
  pull(loads, work);
}

// ---------------------------------------------------------------- derivatives

void SegmentedRod::add_local_stiffness(const Workspace& work, double weight, Matrix& J) const {
  if (weight == 0.0) return;
  for (std::size_t j = 0; j < parts_.size(); ++j) {
    const Part& part = parts_[j];
    const RodConstants& constants = part.constants;
    const Quadrature& grid = *constants.grid;
    const SegmentWorkspace& w = work.segments[j];
    for (int k = 0; k < grid.nodes; ++k) {
      Matrix6 G = Matrix6::Zero();
      for (std::size_t i = 0; i < tcas(); ++i) {
        if (!constants.is_routed[i]) continue;
        const TcaNode node = tca_node(constants, w, i, k);
        const double N = contact_ == Contact::bonded ? w.N[i][k] : work.tension[i].value;
        G += N * constants.length * length_hessian(node);
        if (contact_ == Contact::bonded) {
          const Vector6 gradient = node.D.transpose() * node.t;
          G += constants.length * w.N_stretch[i][k] * gradient * gradient.transpose();
        } else if (ends_ == Ends::tethered) {
          G += work.tethered[i].Q * twist_hessian(node);
        }
      }
      G *= weight;
      for (int b = 0; b < constants.terms; ++b)
        for (int f = 0; f < constants.count; ++f)
          for (int a = 0; a < constants.terms; ++a) {
            const double factor = grid.moment[a][k] * grid.legendre[b][k];
            for (int e = 0; e < constants.count; ++e)
              J(part.first + a * constants.count + e, part.first + b * constants.count + f) +=
                  factor * G(part.components[e], part.components[f]);
          }
    }
  }
}

namespace {

/// Derivatives of a segment in what its neighbours do to it.
void derive(const RodConstants& constants, const SegmentTangentLoops& loops, const Kinematics& w, int unknowns,
            SegmentDerivatives& d) {
  d.r_start.resize(unknowns, 12);
  d.r_end.resize(unknowns, 6);
  for (int e = 0; e < 12; ++e) {
    SegmentColumn column{.r = d.r_start.col(e).data(), .tip = {}, .base = {}};
    loops.base(constants, w, variation(Vector12::Unit(e)), column);
    d.motion.col(e) = dense(column.tip);
    d.base_start.col(e) = dense(column.base);
  }
  for (int e = 0; e < 6; ++e) {
    SegmentColumn column{.r = d.r_end.col(e).data(), .tip = {}, .base = {}};
    loops.wrench(constants, w, wrench(Vector6::Unit(e)), column);
    d.base_end.col(e) = dense(column.base);
  }
}

}  // namespace

void SegmentedRod::tangent(const Workspace& work, const Weights& weights, Matrix& J) const {
  J.setZero(unknowns(), unknowns());
  const std::size_t count = parts_.size();
  std::vector<SegmentDerivatives>& neighbours = work.neighbours;
  const bool has_neighbours = count > 1 || tip_body_.mass != 0.0 || tip_body_.inertia != Triple{};
  if (has_neighbours)
    for (std::size_t j = 0; j < count; ++j)
      derive(parts_[j].constants, parts_[j].tangent_loops, work.segments[j], parts_[j].unknowns(), neighbours[j]);
  const Kinematics& last = work.segments.back();
  const std::array<double, 3> w{weights.q, weights.v, weights.a};
  std::array<Vector6, kMaxSegments> passed;
  for (std::size_t own = 0; own < count; ++own) {
    const Part& part = parts_[own];
    for (int e = 0; e < part.constants.count; ++e)
      for (int a = 0; a < part.constants.terms; ++a) {
        double* column = J.col(part.first + a * part.constants.count + e).data();
        SegmentColumn direct{.r = column + part.first, .tip = {}, .base = {}};
        part.tangent_loops.strain(part.constants, work.segments[own], w, e, a, direct);
        Vector12 motion = dense(direct.tip);
        for (std::size_t j = own + 1; j < count; ++j) {
          Eigen::Map<Vector>(column + parts_[j].first, parts_[j].unknowns()).noalias() = neighbours[j].r_start * motion;
          passed[j] = neighbours[j].base_start * motion;
          motion = neighbours[j].motion * motion;
        }
        passed[own] = dense(direct.base);
        if (!has_neighbours) continue;
        Vector6 end = dense(tip_body_variation(tip_body_, last.tip, work.gravity, last.moving, variation(motion)));
        for (std::size_t j = count; j-- > 0;) {
          Eigen::Map<Vector>(column + parts_[j].first, parts_[j].unknowns()).noalias() += neighbours[j].r_end * end;
          end = neighbours[j].base_end * end;
          if (j >= own) end += passed[j];
        }
      }
  }
  for (const Part& part : parts_) {
    const int n = part.unknowns();
    J.block(part.first, part.first, n, n) += (weights.q + weights.v * part.retardation) * part.stiffness;
  }
  add_local_stiffness(work, weights.q, J);
  for (std::size_t i = 0; i < tcas(); ++i) {
    if (ends_ == Ends::tethered && contact_ != Contact::bonded) {
      const TetheredForce& f = work.tethered[i];
      const Vector &b = work.b[i], &c = work.c[i];
      J.noalias() += weights.q * (f.N_delta * b + f.N_phi * c) * b.transpose();
      J.noalias() += weights.q * (f.N_phi * b + f.Q_phi * c) * c.transpose();
    } else if (work.tension[i].per_delta != 0.0) {
      J.noalias() += (weights.q * work.tension[i].per_delta) * work.b[i] * work.b[i].transpose();
    }
  }
}

void SegmentedRod::rate_derivative(const Workspace& work, const Vector& dv, const Vector& da, Vector& dr) const {
  dr.resize(unknowns());
  SectionVariation motion;
  std::array<Wrench, kMaxSegments> passed;
  for (std::size_t j = 0; j < parts_.size(); ++j) {
    const Part& part = parts_[j];
    SegmentColumn column{.r = dr.data() + part.first, .tip = {}, .base = {}};
    part.tangent_loops.rate(part.constants, work.segments[j], dv.data() + part.first, da.data() + part.first, motion,
                            column);
    motion = column.tip;
    passed[j] = column.base;
  }
  const Kinematics& last = work.segments.back();
  Wrench end = tip_body_variation(tip_body_, last.tip, work.gravity, last.moving, motion);
  Vector& scratch = work.scratch;
  for (std::size_t j = parts_.size(); j-- > 0;) {
    const Part& part = parts_[j];
    const int n = part.unknowns();
    SegmentColumn column{.r = scratch.data() + part.first, .tip = {}, .base = {}};
    part.tangent_loops.wrench(part.constants, work.segments[j], end, column);
    dr.segment(part.first, n) += scratch.segment(part.first, n);
    if (part.retardation != 0.0)
      dr.segment(part.first, n).noalias() += part.retardation * (part.stiffness * dv.segment(part.first, n));
    end = {column.base.force + passed[j].force, column.base.moment + passed[j].moment};
  }
}

void SegmentedRod::load_derivative(const Workspace& work, const Loads& loads, const Loads& rates, Vector& dr) const {
  dr.setZero(unknowns());
  const BodyLoads turned = rates.seen_from(frame_);
  const Kinematics& last = work.segments.back();
  const Wrench body = tip_body_wrench(tip_body_, last.tip, turned.gravity, false);
  Wrench end{turned.tip_force + body.force, turned.tip_moment + body.moment};
  for (std::size_t j = parts_.size(); j-- > 0;) {
    const Part& part = parts_[j];
    end = part.loops.backward(part.constants, segment_loads(part, turned, rates, end), work.segments[j], nullptr,
                              dr.data() + part.first);
  }
  for (std::size_t i = 0; i < tcas(); ++i) {
    if (contact_ == Contact::bonded) {
      for (std::size_t j = 0; j < parts_.size(); ++j) {
        const Part& part = parts_[j];
        const RodConstants& constants = part.constants;
        if (!constants.is_routed[i]) continue;
        const SegmentWorkspace& w = work.segments[j];
        VectorField couple, force;
        for (int p = 0; p < constants.grid->packs; ++p) {
          const Pack rate = (constants.length * rates.T[i]) * w.N_T[i].pack[p];
          couple.set(p, rate * w.arm[i][p]);
          force.set(p, rate * w.t[i][p]);
        }
        project<kMaxPacks>(constants, couple, force, 1.0, work.scratch.data());
        dr.segment(part.first, part.unknowns()) += work.scratch.head(part.unknowns());
      }
    } else if (ends_ == Ends::tethered) {
      dr += work.tethered[i].N_T * rates.T[i] * work.b[i] + work.tethered[i].Q_T * rates.T[i] * work.c[i];
    } else {
      const Tension guessed = laws_[i].tension(loads.delta_guess[i], loads.T[i]);
      const double rate = closure_ == Closure::inside
                              ? work.tension[i].per_T * rates.T[i]
                              : guessed.per_delta * rates.delta_guess[i] + guessed.per_T * rates.T[i];
      dr += rate * work.b[i];
    }
  }
}

}  // namespace rod
