// Elimination along the grid, and back substitution.
#include "pade/frontal_solver.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "numerics/kernel.hpp"

namespace rod::pade {

void FrontalSolver::resize(int points, int tcas) {
  points_ = points;
  columns_ = 1 + tcas;
  start_.assign(points + 1, 0);
  for (int k = 0; k < points; ++k) {
    int count = k <= points - 3 ? kFields : 0;
    if (k == 0) count += kFields;
    if (k == points - 4 || k == points - 1) count += kFields / 2;
    start_[k + 1] = start_[k] + count;
  }
  used_.assign(points, 0);
  equations_.resize(points * kFields);
  pivots_.resize(points * kFields);
  x_.resize((points + kReach - 1) * kFields);  // zeros behind the tip, where no row has coefficients
}

void FrontalSolver::clear() { std::fill(used_.begin(), used_.end(), 0); }

FrontalSolver::Equation& FrontalSolver::add(int first) {
  Equation& equation = equations_[start_[first] + used_[first]++];
  equation = {};
  return equation;
}

namespace {

using Equation = FrontalSolver::Equation;

/// Eliminates the unknowns of the first point from a front of rows with `width` coefficients. The pivot rows come first
/// afterwards.
ROD_INLINE bool eliminate(Equation** front, int rows, int width, int columns) {
  for (int j = 0; j < kFields; ++j) {
    int best = j;
    for (int i = j + 1; i < rows; ++i)
      if (std::abs(front[i]->a[j]) > std::abs(front[best]->a[j])) best = i;
    std::swap(front[j], front[best]);
    const Equation& pivot = *front[j];
    const double inverse = 1.0 / pivot.a[j];
    if (!std::isfinite(inverse)) return false;
    for (int i = j + 1; i < rows; ++i) {
      Equation& row = *front[i];
      const double factor = row.a[j] * inverse;
      if (factor == 0.0) continue;
      for (int c = j + 1; c < width; ++c) row.a[c] -= factor * pivot.a[c];
      for (int c = 0; c < columns; ++c) row.b[c] -= factor * pivot.b[c];
    }
  }
  return true;
}

}  // namespace

bool FrontalSolver::solve() {
  std::array<Equation*, kMaxFrontRows> front{};
  int rows = 0;
  for (int k = 0; k < points_; ++k) {
    for (int i = start_[k]; i < start_[k + 1]; ++i) front[rows++] = &equations_[i];
    const int width = (k == 0 || k >= points_ - kReach ? kReach : kReach - 1) * kFields;
    if (!dispatch<eliminate>(front.data(), rows, width, columns_)) return false;
    std::copy_n(front.begin(), kFields, pivots_.begin() + k * kFields);
    rows -= kFields;
    for (int i = 0; i < rows; ++i) {  // the front's coefficients now begin at the next point
      front[i] = front[i + kFields];
      std::copy(front[i]->a.begin() + kFields, front[i]->a.end(), front[i]->a.begin());
      std::fill(front[i]->a.end() - kFields, front[i]->a.end(), 0.0);
    }
  }
  for (int u = points_ * kFields - 1; u >= 0; --u) {
    const Equation& row = *pivots_[u];
    const int own = u % kFields, base = u - own;
    std::array<double, kMaxColumns> x = row.b;
    for (int c = own + 1; c < kReach * kFields; ++c)
      for (int s = 0; s < columns_; ++s) x[s] -= row.a[c] * x_[base + c][s];
    for (int s = 0; s < columns_; ++s) x[s] /= row.a[own];
    x_[u] = x;
  }
  return std::all_of(x_[0].begin(), x_[0].begin() + columns_, [](double value) { return std::isfinite(value); });
}

}  // namespace rod::pade
