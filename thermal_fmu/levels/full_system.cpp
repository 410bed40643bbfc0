#include "levels/full_system.hpp"

#include <algorithm>

#include "levels/polynomials.hpp"

namespace thermal {
namespace {

using core::value;
using Eigen::Index;

constexpr Index kN = static_cast<Index>(kTcas);

}  // namespace

FullSystem::FullSystem(const HeatMatrices& m, const Parameters& parameters)
    : circuit(parameters),
      root(m.mass.cwiseSqrt()),
      load(root.cwiseInverse().asDiagonal() * m.loads),
      a_((root.cwiseInverse().asDiagonal() * m.stiffness * root.cwiseInverse().asDiagonal()).eval()),
      probes_(m.probes),
      surface_conductance_(m.surface_conductance),
      permuted_(m.size()) {
  factor_.analyzePattern(a_);
}

Status FullSystem::slope(const Drive& drive, double s, const Eigen::Ref<const Vector>& x, Eigen::Ref<Vector> out) {
  out.noalias() = a_ * x;
  out = load.col(kN) * value(drive.ambient_rise, s) - out;
  for (Index i = 0; i < kN; ++i) {
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
    factor_.setShift(1.0 / gamma);
    factor_.factorize(a_);
    if (factor_.info() != Eigen::Success) return false;
    inverse_pivots_ = (gamma * factor_.vectorD()).cwiseInverse();
    gamma_ = gamma;
  }
  permuted_.noalias() = factor_.permutationP() * b;
  factor_.matrixL().solveInPlace(permuted_);
  permuted_.array() *= inverse_pivots_.array();
  factor_.matrixU().solveInPlace(permuted_);
  x.noalias() = factor_.permutationPinv() * permuted_;
  return true;
}

Status FullSystem::observe(const Eigen::Ref<const Vector>& x, const Drive& drive, Observation& seen) {
  if (Status status = slope(drive, 0.0, x, permuted_); !status.is_ok()) return status;
  for (Index i = 0; i < kN; ++i) {
    seen.rise[i] = load.col(i).dot(x);
    seen.rate[i] = load.col(i).dot(permuted_);
    Status status = circuit.power(i, drive.V[i][0], seen.rise[i], drive.delta[i][0], seen.power[i]);
    if (!status.is_ok()) return status;
  }
  const double surface = load.col(kN).dot(x);
  seen.loss = surface - surface_conductance_ * drive.ambient_rise[0];
  seen.surface_rise = surface / surface_conductance_;
  seen.stored = root.dot(x);
  seen.max_rise = -1e300;
  for (const int node : probes_) seen.max_rise = std::max(seen.max_rise, x[node] / root[node]);
  return {};
}

}  // namespace thermal
