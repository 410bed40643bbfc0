#include "engine/past_solutions.hpp"

#include <algorithm>
#include <cmath>

#include "engine/blas.hpp"

namespace engine {

PastSolutions::PastSolutions(TcaComponent& loop)
    : loop_(loop), n_(loop.size), guess_(n_), times_before_(TCA_SOLUTIONS), solutions_before_(TCA_SOLUTIONS * n_) {}

void PastSolutions::add(double time, const double* solution) {
  if (loop_.solved == TCA_SOLUTIONS) {
    std::copy(loop_.times + 1, loop_.times + TCA_SOLUTIONS, loop_.times);
    std::copy(loop_.solutions + n_, loop_.solutions + TCA_SOLUTIONS * n_, loop_.solutions);
    --loop_.solved;
  }
  loop_.times[loop_.solved] = time;
  std::copy_n(solution, n_, loop_.solutions + loop_.solved * n_);
  ++loop_.solved;
}

void PastSolutions::guess(double time, double* values) {
  const std::size_t count = loop_.solved;
  std::size_t degree = std::min<std::size_t>(2, count - 1);
  double least = HUGE_VAL;
  for (std::size_t each = 1; each + 1 < count && count > TCA_LEAST; ++each) {
    extrapolate(count - 2 - each, count - 1, loop_.times[count - 1], guess_.data());
    for (std::size_t i = 0; i < n_; ++i) guess_[i] = (guess_[i] - value(count - 1)[i]) / loop_.scale[i];
    const double error = norm(guess_.data(), n_);
    if (error < least) degree = each, least = error;
  }
  extrapolate(count - 1 - degree, count, time, values);
}

void PastSolutions::extrapolate(std::size_t first, std::size_t end, double time, double* values) const {
  std::fill_n(values, n_, 0.0);
  for (std::size_t k = first; k < end; ++k) {
    double weight = 1.0;
    for (std::size_t j = first; j < end; ++j)
      if (j != k) weight *= (time - loop_.times[j]) / (loop_.times[k] - loop_.times[j]);
    for (std::size_t i = 0; i < n_; ++i) values[i] = values[i] + weight * value(k)[i];
  }
}

void PastSolutions::remember() {
  solved_before_ = loop_.solved;
  std::copy_n(loop_.times, TCA_SOLUTIONS, times_before_.data());
  std::copy_n(loop_.solutions, TCA_SOLUTIONS * n_, solutions_before_.data());
}

void PastSolutions::forget() {
  loop_.solved = solved_before_;
  std::copy_n(times_before_.data(), TCA_SOLUTIONS, loop_.times);
  std::copy_n(solutions_before_.data(), TCA_SOLUTIONS * n_, loop_.solutions);
}

}  // namespace engine
