#include "engine/secants.hpp"

#include <algorithm>

namespace engine {

namespace {

constexpr double independence = 3e-3;  // INDEPENDENCE of secants.py

}  // namespace

Secants::Secants(const TcaBlas& blas, TcaComponent& loop)
    : blas_(blas),
      loop_(loop),
      n_(loop.size),
      column_(2 * n_),
      rest_(2 * n_),
      known_(2 * n_),
      part_(n_),
      old_(2 * n_ * n_),
      combined_(2 * n_ * n_),
      before_(4 * n_ * n_) {}

void Secants::add(const double* dx, const double* dr) {
  const double length = norm(dr, n_);
  if (length == 0.0) return;
  const std::size_t width = 2 * n_, old = loop_.kept;
  std::copy_n(loop_.columns, old * width, old_.data());
  std::fill(combined_.begin(), combined_.end(), 0.0);
  std::size_t kept = 0;
  for (std::size_t k = 0; k <= old && kept < n_; ++k) {
    if (k == 0)
      for (std::size_t i = 0; i < n_; ++i) column_[i] = dr[i] / length, column_[n_ + i] = dx[i] / length;
    else
      std::copy_n(old_.data() + (k - 1) * width, width, column_.data());
    rest_ = column_;
    if (kept) {  // rows that are not filled yet are zero
      blas_.times_vector(n_, n_, combined_.data(), width, column_.data(), part_.data());
      blas_.vector_times(n_, width, combined_.data(), width, part_.data(), known_.data());
      for (std::size_t i = 0; i < width; ++i) rest_[i] = column_[i] - known_[i];
    }
    const double left = norm(rest_.data(), n_);
    if (!(left > independence)) continue;
    for (std::size_t i = 0; i < width; ++i) combined_[kept * width + i] = rest_[i] / left;
    std::copy_n(column_.data(), width, loop_.columns + kept * width);
    ++kept;
  }
  loop_.kept = kept;
  std::copy(combined_.begin(), combined_.end(), loop_.combined);
}

void Secants::split(const double* r, double* secant, double* rest) {
  const std::size_t width = 2 * n_;
  if (loop_.kept) {
    blas_.times_vector(loop_.kept, n_, loop_.combined, width, r, part_.data());
    blas_.vector_times(loop_.kept, width, loop_.combined, width, part_.data(), known_.data());
  } else {
    std::fill(known_.begin(), known_.end(), 0.0);
  }
  for (std::size_t i = 0; i < n_; ++i) secant[i] = -known_[n_ + i], rest[i] = r[i] - known_[i];
}

void Secants::remember() {
  before_kept_ = loop_.kept;
  std::copy_n(loop_.columns, 2 * n_ * n_, before_.data());
  std::copy_n(loop_.combined, 2 * n_ * n_, before_.data() + 2 * n_ * n_);
}

void Secants::forget() {
  loop_.kept = before_kept_;
  std::copy_n(before_.data(), 2 * n_ * n_, loop_.columns);
  std::copy_n(before_.data() + 2 * n_ * n_, 2 * n_ * n_, loop_.combined);
}

}  // namespace engine

void tca_secants(const TcaBlas* blas, TcaComponent* loop, const double* dx, const double* dr, const double* r,
                 double* split) {
  engine::Secants secants(*blas, *loop);
  secants.add(dx, dr);
  secants.split(r, split, split + loop->size);
}
