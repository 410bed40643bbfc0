#include "levels/full_system.hpp"

#include "levels/polynomials.hpp"

namespace thermal {
namespace {

using core::value;
using Eigen::Index;

}  // namespace

FullSystem::FullSystem(const HeatMatrices& m, const Parameters& parameters)
    : circuit(parameters),
      convection(parameters),
      root(m.mass.cwiseSqrt()),
      load(root.cwiseInverse().asDiagonal() * m.loads),
      a_((root.cwiseInverse().asDiagonal() * m.stiffness * root.cwiseInverse().asDiagonal()).eval()),
      factor_(a_, Vector::Ones(m.size())),
      probes_(m.probes),
      peak_(m.probe_patches, static_cast<int>(m.probes.size()), m.order),
      peak_values_(static_cast<Index>(m.probes.size())),
      surface_conductance_(m.surface_conductance),
      T_0_(parameters.T_0),
      permuted_(m.size()),
      is_insulated_(m.is_insulated) {
  if (!convection.is_constant()) surface_ = m.loads.col(m.tcas()).cwiseQuotient(m.mass);
  if (!is_insulated_) return;
  uniform_ = root.normalized();
  loss_ = load.col(tcas()) / root.norm();
}

double FullSystem::convection_ratio(const Eigen::Ref<const Vector>& x, const Drive& drive, double s) const {
  if (convection.is_constant()) return 1.0;
  const double surface = T_0_ + load.col(tcas()).dot(x) / surface_conductance_;
  const double ambient = T_0_ + value(drive.ambient_rise, s);
  return convection.coefficient(surface, ambient, value(drive.air_speed, s)) / convection.reference();
}

Status FullSystem::slope(const Drive& drive, double s, const Eigen::Ref<const Vector>& x, Eigen::Ref<Vector> out) {
  if (is_insulated_) {
    const double mean = uniform_.dot(x);
    out.noalias() = a_ * (x - mean * uniform_);
    out += mean * loss_;
    out += (loss_.dot(x) - uniform_.dot(out)) * uniform_;
  } else {
    out.noalias() = a_ * x;
  }
  out = load.col(tcas()) * value(drive.ambient_rise, s) - out;
  if (!convection.is_constant()) {
    const double more = convection_ratio(x, drive, s) - 1.0;
    out += more * (load.col(tcas()) * value(drive.ambient_rise, s) - surface_.cwiseProduct(x));
  }
  for (Index i = 0; i < tcas(); ++i) {
    const double rise = circuit.has_feedback() ? load.col(i).dot(x) : 0.0;
    double power = 0.0;
    Status status = circuit.power(i, value(drive.V[i], s), rise, value(drive.delta[i], s), power);
    if (!status.is_ok()) return status;
    out += load.col(i) * power;
  }
  return {};
}

bool FullSystem::solve(double gamma, const Eigen::Ref<const Vector>& b, Eigen::Ref<Vector> x) {
  ++counts.solves;
  if (gamma != gamma_) {
    ++counts.factorisations;
    if (!factor_.factor(1.0 / gamma, factors_)) return false;
    inverse_pivots_ = (gamma * factors_.pivots.matrix().transpose()).cwiseInverse();
    gamma_ = gamma;
  }
  factor_.substitute(factors_, inverse_pivots_, b, permuted_, x);
  if (is_insulated_)  // the balance of heat, u' (1 + gamma A) x = u' b
    x += (uniform_.dot(b) - uniform_.dot(x) - gamma * loss_.dot(x)) / (1.0 + gamma * loss_.dot(uniform_)) * uniform_;
  return true;
}

Status FullSystem::observe(const Eigen::Ref<const Vector>& x, const Drive& drive, Observation& seen) {
  if (Status status = slope(drive, 0.0, x, permuted_); !status.is_ok()) return status;
  for (Index i = 0; i < tcas(); ++i) {
    seen.rise[i] = load.col(i).dot(x);
    seen.rate[i] = load.col(i).dot(permuted_);
    Status status = circuit.power(i, drive.V[i][0], seen.rise[i], drive.delta[i][0], seen.power[i]);
    if (!status.is_ok()) return status;
  }
  const double surface = load.col(tcas()).dot(x);
  const double ratio = convection_ratio(x, drive, 0.0);
  seen.loss = ratio * (surface - surface_conductance_ * drive.ambient_rise[0]);
  seen.coefficient = ratio * convection.reference();
  seen.surface_rise = surface / surface_conductance_;
  seen.stored = root.dot(x);
  seen.bound = 0.0;  // nothing is left out of the mesh
  return {};
}

void FullSystem::observe_probes(const Eigen::Ref<const Vector>& x) {
  for (std::size_t k = 0; k < probes_.size(); ++k)
    peak_values_[static_cast<Index>(k)] = x[probes_[k]] / root[probes_[k]];
}

double FullSystem::max_rise(const Eigen::Ref<const Vector>& x) {
  observe_probes(x);
  return peak_.of(peak_values_);
}

bool FullSystem::exceeds(const Eigen::Ref<const Vector>& x, double rise) {
  observe_probes(x);
  return peak_values_.maxCoeff() > rise - kBetweenNodes && peak_.of(peak_values_) > rise;
}

}  // namespace thermal
