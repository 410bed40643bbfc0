// The resistor-capacitor network behind `lumped`, derived from the matrices:
// nodes are the means over the TCAs and over the surface. Their steady responses to heat put in at the same places make
// a symmetric positive matrix whose inverse is the conductance matrix: steady states are exact. The shapes that belong
// to a unit of one node split the heat capacity among the nodes; together they are the uniform temperature, so none is
// lost. The surface meets the surroundings through h times its area, no TCA does.
//
// Means are no points: one may cool another beyond what lies between them (two TCAs opposite each other, six in a
// ring), which no resistors do. Then the nearest network of positive ones is taken. Likewise no capacity is less than
// what an annulus or the surface itself must store. The error so made is in the published bound, measured on the
// network as it is.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "reduction/modal_model.hpp"

namespace thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kNodes = kChannels;
constexpr double kRounding = 1e-12;  // of the largest conductance

/// Step response of seeing channel i from channel j at time t.
double step_response(const ModalModel& m, Index i, Index j, double t) {
  double sum = 0.0;
  for (Index k = 0; k < m.size(); ++k) sum -= m.load(k, i) * m.load(k, j) * std::expm1(-m.rate[k] * t) / m.rate[k];
  return sum;
}

double largest_between(const MatrixXd& conductance) {
  double largest = -1e300;  // of the off-diagonals, which are not positive in a network
  for (Index i = 0; i < kNodes; ++i)
    for (Index j = 0; j < i; ++j) largest = std::max(largest, conductance(i, j));
  return largest;
}

/// Off-diagonals that are not positive and answer most nearly like the resistances R: with conductances g over edges
/// between nodes, least squares of R^(1/2) G(g) R^(1/2) - 1, where edges that come out negative go one by one.
MatrixXd nearest_network(const MatrixXd& R, double surface_conductance) {
  std::vector<std::pair<Index, Index>> edges;
  for (Index i = 0; i < kNodes; ++i)
    for (Index j = i + 1; j < kNodes; ++j) edges.emplace_back(i, j);
  const auto square = [](double x) { return x * x; };
  const auto across = [&](const auto& a, const auto& b) {
    return R(a.first, b.first) - R(a.first, b.second) - R(a.second, b.first) + R(a.second, b.second);
  };
  VectorXd g;
  for (Index worst = -1; !edges.empty(); edges.erase(edges.begin() + worst)) {
    const auto n = static_cast<Index>(edges.size());
    MatrixXd products(n, n);
    VectorXd wanted(n);
    for (Index a = 0; a < n; ++a) {
      for (Index b = 0; b < n; ++b) products(a, b) = square(across(edges[a], edges[b]));
      wanted[a] = across(edges[a], edges[a]) -
                  surface_conductance * square(R(edges[a].first, kNodes - 1) - R(edges[a].second, kNodes - 1));
    }
    g = products.ldlt().solve(wanted);
    if (g.minCoeff(&worst) >= 0.0) break;
  }
  MatrixXd conductance = MatrixXd::Zero(kNodes, kNodes);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto [i, j] = edges[e];
    conductance(i, j) = conductance(j, i) = -g[static_cast<Index>(e)];
  }
  return conductance;
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
  if (largest_between(net.conductance) > kRounding * net.conductance.maxCoeff())
    net.conductance = nearest_network(resistance, matrices.surface_conductance);
  net.conductance = net.conductance.cwiseMin(0.0).eval();
  net.conductance.diagonal().setZero();
  net.conductance.diagonal() = -net.conductance.rowwise().sum();
  net.conductance(kNodes - 1, kNodes - 1) += matrices.surface_conductance;

  net.capacity = net.conductance * (responses.transpose() * matrices.mass);
  // What a mean of 1 K cannot do without, by Cauchy's inequality; these places do not overlap.
  const VectorXd least = (means.cwiseAbs2().transpose() * matrices.mass.cwiseInverse()).cwiseInverse();
  const VectorXd more = (net.capacity - least).cwiseMax(0.0);
  net.capacity = least + more * ((matrices.mass.sum() - least.sum()) / more.sum());
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
