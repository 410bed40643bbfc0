// The resistor-capacitor network behind `lumped`, derived from the matrices:
// nodes are the means over the TCAs and over the surface. Their steady responses to heat put in at the same places make
// a symmetric positive matrix whose inverse is the conductance matrix: steady states are exact. The shapes that belong
// to a unit of one node split the heat capacity among the nodes; together they are the uniform temperature, so none is
// lost. The surface meets the surroundings through h times its area, no TCA does.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "modal_model.hpp"

namespace thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kNodes = kChannels;

/// Step response of seeing channel i from channel j at time t.
double step_response(const ModalModel& m, Index i, Index j, double t) {
  double sum = 0.0;
  for (Index k = 0; k < m.size(); ++k) sum -= m.load(k, i) * m.load(k, j) * std::expm1(-m.rate[k] * t) / m.rate[k];
  return sum;
}

}  // namespace

Network network(const HeatMatrices& matrices) {
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrices.stiffness);
  MatrixXd means = matrices.loads;
  means.rightCols(1) /= matrices.surface_conductance;
  const MatrixXd responses = factor.solve(means);
  const MatrixXd resistance = means.transpose() * responses;
  Network net;
  net.conductance = resistance.llt().solve(MatrixXd::Identity(kNodes, kNodes));
  net.conductance = 0.5 * (net.conductance + net.conductance.transpose()).eval();
  net.capacity = net.conductance * (responses.transpose() * matrices.mass);
  return net;
}

ModalModel lumped(const HeatMatrices& matrices, const ModalModel& reference) {
  const Network net = network(matrices);
  const VectorXd root = net.capacity.cwiseSqrt();
  const MatrixXd scaled = root.cwiseInverse().asDiagonal() * net.conductance * root.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(scaled);
  ModalModel model;
  model.rate = eigen.eigenvalues();
  model.probe = root.cwiseInverse().asDiagonal() * eigen.eigenvectors();
  model.load = model.probe.transpose();
  model.load.rightCols(1) *= matrices.surface_conductance;
  model.capacity = eigen.eigenvectors().transpose() * root;
  model.surface_conductance = matrices.surface_conductance;

  // Largest difference of step responses, on times so close that between two of them nothing hides (5 % apart, over all
  // time constants), on top of what the reference itself may be off.
  model.step_bound = MatrixXd::Zero(kTcas, kChannels);
  const double first = 1e-3 / reference.rate.maxCoeff(), last = 40.0 / std::min(reference.rate[0], model.rate[0]);
  for (double t = first; t < last; t *= 1.05)
    for (Index i = 0; i < static_cast<Index>(kTcas); ++i)
      for (Index j = 0; j < kChannels; ++j)
        model.step_bound(i, j) = std::max(model.step_bound(i, j),
                                          std::abs(step_response(model, i, j, t) - step_response(reference, i, j, t)));
  model.step_bound += reference.step_bound;
  return model;
}

}  // namespace thermal
