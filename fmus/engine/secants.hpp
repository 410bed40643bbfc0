// Secants of past sweeps, as in cosim/acceleration/secants.py.
#pragma once

#include <vector>

#include "engine/blas.hpp"

namespace engine {

class Secants {
 public:
  Secants(const TcaBlas& blas, TcaComponent& loop);

  void add(const double* dx, const double* dr);
  /// Writes the secant step (n) for a residual (n), and the part (n) of the residual that no column covers.
  void split(const double* r, double* secant, double* rest);
  std::size_t kept() const { return loop_.kept; }

  void remember();  ///< What there is now, for forget().
  void forget();

 private:
  Blas blas_;
  TcaComponent& loop_;
  std::size_t n_, before_kept_ = 0;
  std::vector<double> column_, rest_, known_, part_, old_, combined_, before_;
};

}  // namespace engine
