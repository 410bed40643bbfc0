// Gaussian elimination with row pivoting of a matrix whose rows each reach over at most four neighbouring grid points:
// a front of the rows that touch one point moves along the grid, so work and memory are linear in the points. Pivoting
// across points matters: the diagonal blocks of the paper's scheme vanish as the time step grows.
#pragma once

#include <array>
#include <vector>

#include "pade_node.hpp"
#include "pade_scheme.hpp"

namespace rod::pade {

/// Solves for 1 + tcas right-hand sides at once: the residual, and the columns of the tensions.
class FrontSolver {
 public:
  static constexpr int columns = 1 + tcas;

  /// One equation: coefficients of the unknowns of `reach` points from its first point, then its right-hand sides.
  struct Equation {
    std::array<double, reach * fields> a;
    std::array<double, columns> b;
  };

  void resize(int points);
  int points() const { return points_; }

  /// Equation i of point k, set to zero; its first point is `first`, which may not decrease with k but for the last.
  Equation& add(int first);
  void clear();

  /// False: singular, or not finite. The equations are used up.
  bool solve();

  /// Solution for unknown j of point k and right-hand side c.
  double operator()(int k, int j, int c) const { return x_[static_cast<std::size_t>(k * fields + j)][c]; }

 private:
  static constexpr int widest = 3 * fields;  // rows that touch one point: two blocks and the closures at the tip

  bool eliminate(int k, int rows);

  int points_ = 0;
  std::vector<Equation> equations_, upper_;      // as given; triangular
  std::vector<int> first_, order_;               // first point of each equation; equations by first point
  std::array<Equation*, widest> front_{};
  std::vector<std::array<double, columns>> x_;
};

}  // namespace rod::pade
