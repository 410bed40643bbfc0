// Construction of the quadrature tables.
#include "numerics/quadrature.hpp"

#include <cmath>
#include <numbers>

namespace rod {

void legendre_values(double x, int count, double* values) {
  for (int a = 0; a < count; ++a)
    values[a] = a == 0 ? 1.0 : a == 1 ? x : ((2 * a - 1) * x * values[a - 1] - (a - 1) * values[a - 2]) / a;
}

namespace {

/// Roots of P_nodes by Newton's method from the Chebyshev guess, ascending in (-1, 1), with their weights.
void gauss_legendre(int nodes, ScalarField& x, ScalarField& w) {
  std::array<double, kMaxNodes + 1> p;
  for (int k = 0; k < nodes; ++k) {
    double square_root = -std::cos(std::numbers::pi * (k + 0.75) / (nodes + 0.5));
    double slope = 0.0;
    for (int iteration = 0; iteration < 100; ++iteration) {
      legendre_values(square_root, nodes + 1, p.data());
      slope = nodes * (square_root * p[nodes] - p[nodes - 1]) / (square_root * square_root - 1.0);
      const double change = p[nodes] / slope;
      square_root -= change;
      if (std::abs(change) < 1e-16) break;
    }
    x[k] = square_root;
    w[k] = 2.0 / ((1.0 - square_root * square_root) * slope * slope);
  }
}

/// int_{-1}^{x} of the Lagrange polynomial of node j, through its Legendre series: with l_j = sum_a c_a P_a, c_a =
/// (2a+1)/2 w_j P_a(x_j) (exact on Gauss points) and int_{-1}^{x} P_a = (P_{a+1}(x) - P_{a-1}(x))/(2a+1).
double lagrange_integral(int nodes, double node, double weight, double x) {
  std::array<double, kMaxNodes + 1> at_node, at_x;
  legendre_values(node, nodes + 1, at_node.data());
  legendre_values(x, nodes + 1, at_x.data());
  double sum = 0.5 * weight * (x + 1.0);
  for (int a = 1; a < nodes; ++a) sum += 0.5 * weight * at_node[a] * (at_x[a + 1] - at_x[a - 1]);
  return sum;
}

}  // namespace

Quadrature::Quadrature(int packs)
    : packs(packs),
      nodes(packs * kPackSize),
      pieces(pieces_of(packs)),
      intervals(pieces * (nodes + 1)),
      interval_packs(interval_packs_of(packs)),
      max_curvature(packs == 3   ? 19.0
                    : packs == 4 ? 30.0
                                 : 43.0) {
  ScalarField x, weight;
  gauss_legendre(nodes, x, weight);
  for (int k = 0; k < nodes; ++k) {
    s[k] = 0.5 * (1.0 + x[k]);
    w[k] = 0.5 * weight[k];
  }
  for (int j = 0; j < nodes; ++j) {
    for (int k = 0; k < nodes; ++k) forward[j][k] = 0.5 * lagrange_integral(nodes, x[j], weight[j], x[k]);
    for (int m = 0; m < static_cast<int>(kShapeStations); ++m)
      stations[j][m] = 0.5 * lagrange_integral(nodes, x[j], weight[j], 2.0 * m / (kShapeStations - 1) - 1.0);
  }
  for (int k = 0; k < nodes; ++k)
    for (int j = 0; j < nodes; ++j) adjoint[k][j] = w[k] * forward[j][k] / w[j];

  std::array<double, kMaxTerms + 1> values;
  for (int k = 0; k < nodes; ++k) {
    legendre_values(x[k], kMaxTerms + 1, values.data());
    for (int a = 0; a < kMaxTerms; ++a) {
      legendre[a][k] = values[a];
      moment[a][k] = w[k] * values[a];
      legendre_integral[a][k] = a == 0 ? s[k] : (values[a + 1] - values[a - 1]) / (2.0 * (2 * a + 1));
    }
  }
  const double gauss_3[kGaussPoints] = {-std::sqrt(0.6), 0.0, std::sqrt(0.6)};
  for (int e = 0; e < intervals; ++e) {
    const int gap = e / pieces;
    const double left = gap == 0 ? 0.0 : s[gap - 1], right = gap == nodes ? 1.0 : s[gap];
    length[e] = (right - left) / pieces;
    const double from = left + (e % pieces) * length[e], to = from + length[e];
    for (int g = 0; g < kGaussPoints; ++g) {
      legendre_values(from + to + gauss_3[g] * length[e] - 1.0, kMaxTerms, values.data());
      for (int a = 0; a < kMaxTerms; ++a) legendre_at_gauss_points[a][g][e] = values[a];
    }
  }
}

namespace {

const std::array<Quadrature, 3>& tables() {
  static const std::array<Quadrature, 3> all{Quadrature(3), Quadrature(4), Quadrature(5)};
  return all;
}

}  // namespace

const Quadrature& quadrature(int order, double turns) {
  std::size_t rule = order < 4 ? 0 : order == 4 ? 1 : 2;
  while (rule + 1 < tables().size() && turns > 0.5 * tables()[rule].max_curvature) ++rule;
  return tables()[rule];
}

void integral_weights(const Quadrature& grid, double x, ScalarField& weights) {
  for (int j = 0; j < grid.nodes; ++j)
    weights[j] = 0.5 * lagrange_integral(grid.nodes, 2.0 * grid.s[j] - 1.0, 2.0 * grid.w[j], 2.0 * x - 1.0);
}

double max_resolved_curvature() { return tables().back().max_curvature; }

}  // namespace rod
