// Exact derivatives of the residual of a body of segments: the chain of the derivatives of its segments.
#include <Eigen/Dense>
#include <algorithm>

#include "mechanics/polynomials.hpp"
#include "mechanics/segmented_rod.hpp"
#include "mechanics/tca_node.hpp"
#include "numerics/kernel.hpp"

namespace rod {

namespace {

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
