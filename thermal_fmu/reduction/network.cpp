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
#include <Eigen/QR>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "mesh/insulated.hpp"
#include "reduction/graded_eigen.hpp"
#include "reduction/modal_model.hpp"

namespace thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRounding = 1e-12;  // of the largest conductance

/// Step response of seeing channel i from channel j at time t.
double step_response(const ModalModel& m, Index i, Index j, double t) {
  double sum = 0.0;
  for (Index k = 0; k < m.size(); ++k) sum -= m.load(k, i) * m.load(k, j) * std::expm1(-m.rate[k] * t) / m.rate[k];
  return sum;
}

double largest_between(const MatrixXd& conductance) {
  double largest = -1e300;  // of the off-diagonals, which are not positive in a network
  for (Index i = 0; i < conductance.rows(); ++i)
    for (Index j = 0; j < i; ++j) largest = std::max(largest, conductance(i, j));
  return largest;
}

/// Off-diagonals that are not positive and answer most nearly like the resistances R: with conductances g over edges
/// between nodes, least squares of R^(1/2) G(g) R^(1/2) - 1, where edges that come out negative go one by one.
MatrixXd nearest_network(const MatrixXd& R, double surface_conductance) {
  const Index nodes = R.rows();
  std::vector<std::pair<Index, Index>> edges;
  for (Index i = 0; i < nodes; ++i)
    for (Index j = i + 1; j < nodes; ++j) edges.emplace_back(i, j);
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
                  surface_conductance * square(R(edges[a].first, nodes - 1) - R(edges[a].second, nodes - 1));
    }
    g = products.ldlt().solve(wanted);
    if (g.minCoeff(&worst) >= 0.0) break;
  }
  MatrixXd conductance = MatrixXd::Zero(nodes, nodes);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto [i, j] = edges[e];
    conductance(i, j) = conductance(j, i) = -g[static_cast<Index>(e)];
  }
  return conductance;
}

/// Eigenpairs of the scaled conductances: the uniform temperature, root.normalized(), is nearly one of an insulated
/// section, and its image is known exactly.
Eigenpairs network_modes(const MatrixXd& scaled, const VectorXd& root, double surface_conductance) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(scaled);
  // The rate of the uniform temperature, by the next eigenvalue: then it is nearly the first eigenvector. A slow TCA of
  // bad conductivity alone is no such case.
  constexpr double kGraded = 1e-3;
  if (surface_conductance / root.squaredNorm() > kGraded * eigen.eigenvalues()[1])
    return {eigen.eigenvalues(), eigen.eigenvectors()};
  const Index nodes = root.size();
  MatrixXd basis = MatrixXd::Identity(nodes, nodes);
  basis.col(0) = root.normalized();
  basis = Eigen::HouseholderQR<MatrixXd>(basis).householderQ();
  if (basis(0, 0) < 0.0) basis.col(0) = -basis.col(0);
  VectorXd image = VectorXd::Zero(nodes);
  image[nodes - 1] = surface_conductance / (root[nodes - 1] * root.norm());
  MatrixXd turned = basis.transpose() * scaled * basis;
  turned.col(0) = basis.transpose() * image;
  turned.row(0) = turned.col(0).transpose();
  const Eigenpairs graded = graded_eigenpairs(turned);
  return {graded.values, basis * graded.vectors};
}

}  // namespace

Network network(const HeatMatrices& matrices) {
  const Index tcas = matrices.tcas(), nodes = tcas + 1;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrices.stiffness);
  MatrixXd means = matrices.loads;
  means.rightCols(1) /= matrices.surface_conductance;
  MatrixXd responses = factor.solve(means);
  MatrixXd resistance = means.transpose() * responses;
  Network net;
  const bool is_split = is_insulated(resistance(0, 0), resistance(0, 0) - resistance(tcas, 0));
  if (is_split) {
    // Rises above the surface's mean only: what the surface itself rises by, 1/(h S), is common to all nodes and leaves
    // the conductances to the surface and the heat capacities as they are.
    responses = MatrixXd::Zero(matrices.size(), nodes);
    responses.leftCols(tcas) = rises_above_surface(matrices);
    const MatrixXd above = (means.leftCols(tcas).transpose() * responses.leftCols(tcas)).eval();
    const MatrixXd between = (0.5 * (above + above.transpose())).llt().solve(MatrixXd::Identity(tcas, tcas));
    net.conductance.resize(nodes, nodes);
    net.conductance.topLeftCorner(tcas, tcas) = between;
    net.conductance.topRightCorner(tcas, 1) = -between.rowwise().sum();
    net.conductance.bottomLeftCorner(1, tcas) = -between.colwise().sum();
    net.conductance(tcas, tcas) = between.sum() + matrices.surface_conductance;
    resistance.setZero();  // less what is common: only differences count
    resistance.topLeftCorner(tcas, tcas) = above;
  } else {
    net.conductance = resistance.llt().solve(MatrixXd::Identity(nodes, nodes));
  }
  net.conductance = 0.5 * (net.conductance + net.conductance.transpose()).eval();
  if (largest_between(net.conductance) > kRounding * net.conductance.maxCoeff())
    net.conductance = nearest_network(resistance, matrices.surface_conductance);
  net.conductance = net.conductance.cwiseMin(0.0).eval();
  net.conductance.diagonal().setZero();
  net.conductance.diagonal() = -net.conductance.rowwise().sum();
  net.conductance(nodes - 1, nodes - 1) += matrices.surface_conductance;

  net.capacity = net.conductance * (responses.transpose() * matrices.mass);
  if (is_split) net.capacity[tcas] += matrices.mass.sum();  // of what is common: G (1/(h S)) 1 = e_S
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
  const Eigenpairs eigen = network_modes(scaled, root, matrices.surface_conductance);
  ModalModel model;
  model.rate = eigen.values;
  model.probe = root.cwiseInverse().asDiagonal() * eigen.vectors;
  model.load = model.probe.transpose();
  model.load.rightCols(1) *= matrices.surface_conductance;
  model.capacity = eigen.vectors.transpose() * root;
  model.surface_conductance = matrices.surface_conductance;

  // Largest difference of step responses, on times so close that between two of them nothing hides (5 % apart, over all
  // time constants), on top of what the reference itself may be off.
  const Index tcas = matrices.tcas();
  model.step_bound = MatrixXd::Zero(tcas, tcas + 1);
  const double first = 1e-3 / reference.rate.maxCoeff(), last = 40.0 / std::min(reference.rate[0], model.rate[0]);
  for (double t = first; t < last; t *= 1.05)
    for (Index i = 0; i < tcas; ++i)
      for (Index j = 0; j <= tcas; ++j)
        model.step_bound(i, j) = std::max(model.step_bound(i, j),
                                          std::abs(step_response(model, i, j, t) - step_response(reference, i, j, t)));
  model.step_bound += reference.step_bound;
  model.reference = reference.reference;
  model.bound = model.step_bound.leftCols(tcas).diagonal().cwiseQuotient(model.reference).maxCoeff();
  return model;
}

}  // namespace thermal
