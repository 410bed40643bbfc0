#include "mesh/spectral.hpp"

#include <cmath>
#include <numbers>

namespace thermal {
namespace {

/// Legendre polynomials of degree p and p - 1 at x.
std::pair<double, double> legendre(int p, double x) {
  double below = 1.0, here = x;
  for (int k = 2; k <= p; ++k) {
    const double next = ((2 * k - 1) * x * here - (k - 1) * below) / k;
    below = here;
    here = next;
  }
  return {here, below};
}

}  // namespace

LobattoRule lobatto_rule(int order) {
  const int p = order, n = p + 1;
  LobattoRule rule{Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::MatrixXd::Zero(n, n)};
  Eigen::VectorXd values(n);  // of the Legendre polynomial of degree p at the nodes
  for (int i = 0; i < n; ++i) {
    double x = -std::cos(std::numbers::pi * i / p);
    for (int iteration = 0; iteration < 50; ++iteration) {
      // The nodes are the zeros of (1 - x^2) P_p'(x) = p (P_{p-1} - x P_p), whose slope is -p (p + 1) P_p.
      const auto [here, below] = legendre(p, x);
      const double change = (below - x * here) / ((p + 1) * here);
      x += change;
      if (std::abs(change) < 1e-16) break;
    }
    rule.nodes[i] = x;
    values[i] = legendre(p, x).first;
    rule.weights[i] = 2.0 / (p * n * values[i] * values[i]);
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      if (i != j) rule.derivative(i, j) = values[i] / (values[j] * (rule.nodes[i] - rule.nodes[j]));
    }
    rule.derivative(i, i) = -rule.derivative.row(i).sum();  // constants have slope 0 to rounding
  }
  return rule;
}

}  // namespace thermal
