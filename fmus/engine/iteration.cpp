#include "engine/iteration.hpp"

namespace engine {

namespace {

// Those of orchestration/cosim/acceleration (__init__.py, history.py, quasi_newton.py): both must give the same bits.
constexpr double blind_share = 1e-3, noise_share = 0.01, max_blind_step = 0.02, stalled = 0.5;

}  // namespace

Iteration::Iteration(const TcaBlas& blas, TcaComponent& loop, LoopLimits limits)
    : scale_(loop.scale), limits_(limits), secants_(blas, loop), n_(loop.size) {
  for (auto* each : {&swept_, &r_, &r_before_, &x_before_, &scaled_, &secant_, &rest_, &difference_}) each->resize(n_);
}

bool Iteration::is_near(const double* start, const std::vector<double>& x) {
  for (std::size_t i = 0; i < n_; ++i) difference_[i] = (x[i] - start[i]) / scale_[i];
  return norm(difference_.data(), n_) <= limits_.radius;
}

// Judges the newest sweep. Where the estimated error is within the tolerance, x becomes the solution.
void Iteration::estimate(std::vector<double>& x, LoopResult& result) {
  std::swap(r_, r_before_);
  std::swap(scaled_, x_before_);
  for (std::size_t i = 0; i < n_; ++i) r_[i] = (swept_[i] - x[i]) / scale_[i], scaled_[i] = x[i] / scale_[i];
  result.residual = norm(r_.data(), n_);
  if (!(result.residual < HUGE_VAL)) return;
  if (result.sweeps > 1.0) {
    for (std::size_t i = 0; i < n_; ++i) x_before_[i] = scaled_[i] - x_before_[i], r_before_[i] = r_[i] - r_before_[i];
    const double change = std::max(norm(x_before_.data(), n_), norm(r_before_.data(), n_));
    if (change > noise_share * limits_.tolerance) secants_.add(x_before_.data(), r_before_.data());
  }
  secants_.split(r_.data(), secant_.data(), rest_.data());
  for (std::size_t i = 0; i < n_; ++i) difference_[i] = secant_[i] + rest_[i];
  const double of_guess = norm(difference_.data(), n_);
  for (std::size_t i = 0; i < n_; ++i) difference_[i] -= r_[i];
  result.error = std::max(of_guess, norm(difference_.data(), n_));
  result.good = result.error <= (secants_.kept() ? limits_.tolerance : blind_share * limits_.tolerance);
  if (!result.good) return;
  for (std::size_t i = 0; i < n_; ++i) x[i] = x[i] + scale_[i] * (secant_[i] + rest_[i]);
}

// Whether a linear loop would have been solved by now; what is tried then is in quasi_newton.py alone.
bool Iteration::is_stalled(const LoopResult& result) {
  has_grown_ = has_grown_ || result.residual > before_;
  const bool is_late = result.sweeps > static_cast<double>(n_ + 2) && result.residual > stalled * least_;
  before_ = result.residual;
  least_ = std::min(least_, before_);
  return is_late && has_grown_;
}

void Iteration::update(std::vector<double>& x) {
  const double length = norm(rest_.data(), n_), known = norm(secant_.data(), n_);
  const double share = std::min(1.0, length != 0.0 ? std::max(max_blind_step, known) / length : 1.0);
  for (std::size_t i = 0; i < n_; ++i) x[i] = x[i] + scale_[i] * (secant_[i] + share * rest_[i]);
}

}  // namespace engine
