// Frontal elimination with row pivoting of a matrix whose rows each extend over at most four neighbouring grid points:
// a front of the rows with coefficients at one point moves along the grid, so work and memory are linear in the points.
// Rows are exchanged across points because the diagonal blocks of the paper's scheme vanish as the time step grows.
#pragma once

#include <array>
#include <vector>

#include "pade/compact_differences.hpp"
#include "pade/node.hpp"

namespace rod::pade {

/// Solves for 1 + tcas right-hand sides at once: the residual, and the columns of the tensions.
class FrontalSolver {
 public:
  static constexpr int kMaxColumns = 1 + static_cast<int>(kMaxTcas);

  /// One equation: coefficients of the unknowns of `reach` points from its first point on, then its right-hand sides.
  struct Equation {
    std::array<double, kReach * kFields> a;
    std::array<double, kMaxColumns> b;
  };

  void resize(int points, int tcas);

  /// Starts a new system.
  void clear();
  /// Adds an equation whose first point is `first`, with zero coefficients. There must be 24 for point 0, 12 for each
  /// of 1 ... n - 3, 6 more for n - 4 and 6 for n - 1: those of the compact scheme with half of the closures at each
  /// end.
  Equation& add(int first);
  /// Returns false if the matrix is singular or not finite. Overwrites the equations.
  bool solve();

  /// Solution for unknown j of point k and right-hand side c.
  double operator()(int k, int j, int c) const { return x_[k * kFields + j][c]; }

 private:
  static constexpr int kMaxFrontRows = 3 * kFields;  // rows with coefficients at one point

  int points_ = 0, columns_ = 0;
  std::vector<Equation> equations_;
  std::vector<Equation*> pivots_;  // row of the triangle for each unknown
  std::vector<int> start_, used_;  // index of the first equation of each point; number of them
  std::vector<std::array<double, kMaxColumns>> x_;
};

}  // namespace rod::pade
