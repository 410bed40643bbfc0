// Solutions of a loop at the last macro steps, and the guess of the next, as cosim/acceleration/past_solutions.py.
#pragma once

#include <vector>

#include "engine/block.h"

namespace engine {

class PastSolutions {
 public:
  explicit PastSolutions(TcaComponent& loop);

  void add(double time, const double* solution);  ///< Appends the solution (n); the oldest is dropped.
  /// Writes the unknowns (n) at `time` [s]; there is at least one solution.
  void guess(double time, double* values);

  void remember();  ///< What there is now, for forget().
  void forget();

 private:
  const double* value(std::size_t k) const { return loop_.solutions + k * n_; }
  void extrapolate(std::size_t first, std::size_t end, double time, double* values) const;

  TcaComponent& loop_;
  std::size_t n_, solved_before_ = 0;
  std::vector<double> guess_, times_before_, solutions_before_;
};

}  // namespace engine
