// One-dimensional Gauss-Lobatto-Legendre rule: nodes, weights, derivatives of the Lagrange polynomials through the
// nodes.
#pragma once

#include <Eigen/Core>

namespace thermal {

struct LobattoRule {
  Eigen::VectorXd nodes;       // in [-1, 1], ascending
  Eigen::VectorXd weights;     // sum 2
  Eigen::MatrixXd derivative;  // (i, j): slope of the j-th Lagrange polynomial at node i
};

/// Order p >= 1: p + 1 nodes, exact for polynomials of degree 2 p - 1.
LobattoRule lobatto_rule(int order);

}  // namespace thermal
