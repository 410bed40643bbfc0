// Quasi-Newton iteration (IQN) of a loop x = G(x), as solve() of cosim/acceleration does it.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/secants.hpp"

namespace engine {

struct LoopResult {
  bool good = false;
  double sweeps = 0.0, residual = 0.0, error = 0.0;
};

struct LoopLimits {
  double tolerance;  // of the coupling error, share of the nominals
  double radius;     // largest distance of a guess from the start, in nominals
  std::size_t max_sweeps;
};

class Iteration {
 public:
  Iteration(const TcaBlas& blas, TcaComponent& loop, LoopLimits limits);

  /// Iterates from the guess x (n), in which it leaves the solution; start (n): what guesses may not be far from.
  /// sweep(x, swept): whether G could be evaluated; restore(): called before all sweeps but the first.
  template <class Sweep, class Restore>
  LoopResult solve(const double* start, std::vector<double>& x, Sweep sweep, Restore restore) {
    LoopResult result;
    before_ = least_ = HUGE_VAL, has_grown_ = false;
    for (;;) {
      if (!is_near(start, x) || (result.sweeps > 0.0 && !restore()) || !sweep(x, swept_.data())) return result;
      result.sweeps += 1.0;
      estimate(x, result);
      if (result.good || !(result.residual < HUGE_VAL) || result.sweeps >= static_cast<double>(limits_.max_sweeps) ||
          is_stalled(result))
        return result;
      update(x);
    }
  }

  void remember() { secants_.remember(); }  ///< What was learned so far, for forget().
  void forget() { secants_.forget(); }

 private:
  bool is_near(const double* start, const std::vector<double>& x);
  void estimate(std::vector<double>& x, LoopResult& result);
  bool is_stalled(const LoopResult& result);
  void update(std::vector<double>& x);

  const double* scale_;
  const LoopLimits limits_;
  Secants secants_;
  std::size_t n_;
  double before_ = 0.0, least_ = 0.0;  // residuals of earlier sweeps of a step: the newest, and the least
  bool has_grown_ = false;             // a residual, from sweep to sweep
  std::vector<double> swept_, r_, r_before_, x_before_, scaled_, secant_, rest_, difference_;
};

}  // namespace engine
