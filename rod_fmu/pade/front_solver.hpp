// Gaussian elimination with row pivoting of a matrix whose rows each reach over at most four neighbouring grid points:
// a front of the rows that touch one point moves along the grid, so work and memory are linear in the points. Pivoting
// across points matters: the diagonal blocks of the paper's scheme vanish as the time step grows.
#pragma once

#include <array>
#include <vector>

#include "pade/compact_differences.hpp"
#include "pade/node.hpp"

namespace rod::pade {

/// Solves for 1 + tcas right-hand sides at once: the residual, and the columns of the tensions.
class FrontSolver {
 public:
  static constexpr int columns = 1 + tcas;

  /// One equation: coefficients of the unknowns of `reach` points from its first point on, then its right-hand sides.
  struct Equation {
    std::array<double, reach * fields> a;
    std::array<double, columns> b;
  };

  void resize(int points);

  /// Starts a new system.
  void clear();
  /// The next equation whose first point is `first`, all zero. In all: 24 for point 0, 12 for each of 1 ... n - 3,
  /// 6 more for n - 4, 6 for n - 1, which is what the compact scheme with two half sets of closures makes.
  Equation& add(int first);
  /// False: singular, or not finite. The equations are used up.
  bool solve();

  /// Solution for unknown j of point k and right-hand side c.
  double operator()(int k, int j, int c) const { return x_[k * fields + j][c]; }

 private:
  static constexpr int widest = 3 * fields;  // rows that touch one point

  int points_ = 0;
  std::vector<Equation> equations_;
  std::vector<Equation*> pivots_;  // row of the triangle for each unknown
  std::vector<int> start_, used_;  // place of the first equation of each point; how many are there
  std::vector<std::array<double, columns>> x_;
};

}  // namespace rod::pade
