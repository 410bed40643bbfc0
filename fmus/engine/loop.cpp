#include "engine/loop.hpp"

#include <algorithm>
#include <cmath>

namespace engine {

namespace {

// Those of orchestration/cosim/acceleration (__init__.py, history.py, quasi_newton.py): both must give the same bits.
constexpr double blind_share = 1e-3, noise_share = 0.01, max_blind_step = 0.02, stalled = 0.5;

}  // namespace

Loop::Loop(const TcaBlock& block, TcaComponent& component, std::vector<Subsystem>& nodes)
    : block_(block),
      component_(component),
      nodes_(nodes),
      secants_(block.blas, component),
      past_(component),
      n_(component.size),
      guesses_(nodes.size()),
      guess_(nodes.size()) {
  for (auto* each : {&start_, &x_, &swept_, &r_, &r_before_, &x_before_, &scaled_, &secant_, &rest_, &difference_})
    each->resize(n_);
  for (std::size_t k = 0; k < component.sources; ++k) {
    std::vector<double>& guess = guesses_[component.source[k]];
    guess.resize(1 + 2 * nodes[component.source[k]].node().outputs);
    guess_[component.source[k]] = guess.data();
  }
}

void Loop::pack(const double* (*sample)(Subsystem&), double* x) {
  const std::size_t* output = component_.output;
  for (std::size_t k = 0; k < component_.sources; ++k) {
    const double* from = sample(nodes_[component_.source[k]]);
    for (std::size_t i = 0; i < component_.source_size[k]; ++i) *x++ = from[1 + *output++];
  }
}

bool Loop::sweep(const std::vector<double>& x, double time, double length, double end) {
  const std::size_t* output = component_.output;
  const double* value = x.data();
  for (std::size_t k = 0; k < component_.sources; ++k) {
    const std::size_t source = component_.source[k];
    std::vector<double>& guess = guesses_[source];
    std::copy_n(nodes_[source].past(2), guess.size(), guess.data());
    guess[0] = end;
    for (std::size_t i = 0; i < component_.source_size[k]; ++i) guess[1 + *output++] = *value++;
  }
  const std::size_t last = component_.first + component_.count;
  for (std::size_t k = component_.first; k < last; ++k) {
    const TcaNode& node = nodes_[k].node();
    if (!nodes_[k].receive(node.torn_group, node.torn, nodes_, time, guess_.data())) return false;
  }
  for (std::size_t k = component_.first; k < last; ++k) {
    const TcaNode& node = nodes_[k].node();
    if (!nodes_[k].receive(node.forward_group, node.forward, nodes_, time) || !nodes_[k].step(time, length, end))
      return false;
  }
  pack([](Subsystem& node) { return node.current(); }, swept_.data());
  return true;
}

LoopResult Loop::solve(double time, double length, double end) {
  pack([](Subsystem& node) { return node.past(2); }, start_.data());
  if (component_.solved < TCA_LEAST || component_.times[component_.solved - 1] != time) return {};
  past_.guess(end, x_.data());
  const double* scale = component_.scale;
  LoopResult result;
  double before = HUGE_VAL, least = HUGE_VAL;  // residuals of earlier sweeps
  bool grown = false;
  for (;;) {
    for (std::size_t i = 0; i < n_; ++i) difference_[i] = (x_[i] - start_[i]) / scale[i];
    if (!(norm(difference_.data(), n_) <= block_.radius)) return {};
    if (result.sweeps > 0.0)
      for (std::size_t k = component_.first; k < component_.first + component_.count; ++k)
        if (!nodes_[k].restore()) return {};
    if (!sweep(x_, time, length, end)) return {};
    result.sweeps += 1.0;
    std::swap(r_, r_before_);
    std::swap(scaled_, x_before_);
    for (std::size_t i = 0; i < n_; ++i) r_[i] = (swept_[i] - x_[i]) / scale[i], scaled_[i] = x_[i] / scale[i];
    result.residual = norm(r_.data(), n_);
    if (!(result.residual < HUGE_VAL)) return {};
    if (result.sweeps > 1.0) {
      for (std::size_t i = 0; i < n_; ++i)
        x_before_[i] = scaled_[i] - x_before_[i], r_before_[i] = r_[i] - r_before_[i];
      if (norm(x_before_.data(), n_) > noise_share * block_.tolerance) secants_.add(x_before_.data(), r_before_.data());
    }
    secants_.split(r_.data(), secant_.data(), rest_.data());
    for (std::size_t i = 0; i < n_; ++i) difference_[i] = secant_[i] + rest_[i];
    const double of_guess = norm(difference_.data(), n_);
    for (std::size_t i = 0; i < n_; ++i) difference_[i] -= r_[i];
    result.error = std::max(of_guess, norm(difference_.data(), n_));
    if (result.error <= (secants_.kept() ? block_.tolerance : blind_share * block_.tolerance)) {
      for (std::size_t i = 0; i < n_; ++i) x_[i] = x_[i] + scale[i] * (secant_[i] + rest_[i]);
      past_.add(end, x_.data());
      result.good = true;
      return result;
    }
    if (result.sweeps >= static_cast<double>(block_.max_sweeps)) return {};
    grown = grown || result.residual > before;
    const bool late = result.sweeps > static_cast<double>(n_ + 2) && result.residual > stalled * least;
    if (late && grown) return {};  // what comes then is in quasi_newton.py alone
    before = result.residual;
    least = std::min(least, before);
    update();
  }
}

void Loop::update() {
  const double length = norm(rest_.data(), n_), known = norm(secant_.data(), n_);
  const double share = std::min(1.0, length != 0.0 ? std::max(max_blind_step, known) / length : 1.0);
  for (std::size_t i = 0; i < n_; ++i) x_[i] = x_[i] + component_.scale[i] * (secant_[i] + share * rest_[i]);
}

void Loop::remember() {
  secants_.remember();
  past_.remember();
}

void Loop::forget() {
  secants_.forget();
  past_.forget();
}

}  // namespace engine
