#include "engine/subsystem.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

namespace engine {

namespace {

using Clock = std::chrono::steady_clock;

/// Adds the time until its end to a sum [s].
class Timer {
 public:
  explicit Timer(double& sum) : sum_(sum), begin_(Clock::now()) {}
  ~Timer() { sum_ += std::chrono::duration<double>(Clock::now() - begin_).count(); }

 private:
  double& sum_;
  Clock::time_point begin_;
};

template <class Function, class... Arguments>
bool call(void* address, Arguments... arguments) {
  return reinterpret_cast<Function*>(address)(arguments...) == fmi2OK;
}

bool all_finite(const double* values, std::size_t n) {
  return std::all_of(values, values + n, [](double value) { return std::isfinite(value); });
}

}  // namespace

void fit_cubic(const Blas& blas, std::size_t n, const double* from, const double* to, double* polynomial) {
  const volatile double two = 2.0;  // compilers take h * h for pow(h, 2.0), Python does not
  const double h = to[0] - from[0], square = std::pow(h, two), cube = std::pow(h, 3.0);
  const double weights[rows * rows] = {1.0, 0.0,          0.0,          0.0,         0.0,          1.0,
                                       0.0, 0.0,          0.0,          -4.0 / h,    6.0 / square, -2.0 / h,
                                       0.0, 6.0 / square, -12.0 / cube, 6.0 / square};
  std::vector<double> of(rows * n);
  for (std::size_t k = 0; k < n; ++k) {
    of[k] = from[1 + k];
    of[n + k] = from[1 + n + k];
    of[2 * n + k] = to[1 + k] - from[1 + k];
    of[3 * n + k] = to[1 + n + k];
  }
  blas.times_matrix(weights, of.data(), n, polynomial);
}

Subsystem::Subsystem(TcaNode& node, const TcaBlas& blas)
    : node_(&node),
      blas_(blas),
      component_(node.component),
      current_(1 + 2 * node.outputs),
      polynomial_(rows * node.outputs),
      ones_(node.outputs, 1) {
  for (int order = 1; order < rows; ++order)
    for (std::size_t k = 0; k < node.inputs; ++k) {
      derivative_references_.push_back(node.input_references[k]);
      derivative_orders_.push_back(order);
    }
}

bool Subsystem::save() {
  restores_before_ = node_->restores;
  if (!component_) return true;
  const Timer timer(node_->seconds);
  return call<fmi2GetFMUstateTYPE>(node_->get_state, component_, node_->state);
}

bool Subsystem::restore() {
  if (!component_) return true;
  const Timer timer(node_->seconds);
  node_->has_sent = 0;
  ++node_->restores;
  return call<fmi2SetFMUstateTYPE>(node_->set_state, component_, *node_->state);
}

bool Subsystem::go_back() {
  const bool good = restore();
  node_->restores = restores_before_;
  return good;
}

bool Subsystem::step(double time, double length, double end) {
  if (!component_) {
    std::copy_n(past(2), current_.size(), current_.data());
    current_[0] = end;
    return true;
  }
  const Timer timer(node_->seconds);
  if (!send_inputs()) return false;
  if (!call<fmi2DoStepTYPE>(node_->do_step, component_, time, length, fmi2True)) return false;
  return sample(end);
}

bool Subsystem::send_inputs() {
  const std::size_t n = node_->inputs, bytes = rows * n * sizeof(double);
  if (!n || (node_->has_sent && !std::memcmp(node_->polynomials, node_->sent, bytes))) return true;
  node_->has_sent = 0;
  if (!call<fmi2SetRealTYPE>(node_->set_real, component_, node_->input_references, n, node_->polynomials)) return false;
  // Compared by bits, as the master does: a derivative of -0 is sent.
  const auto is_zero = [](double value) { return value == 0.0 && !std::signbit(value); };
  int degree = node_->accepted_degree;
  while (degree && std::all_of(node_->polynomials + degree * n, node_->polynomials + (degree + 1) * n, is_zero))
    --degree;
  node_->degree = std::max(node_->degree, degree);
  if (node_->degree && node_->takes_polynomials &&
      !call<fmi2SetRealInputDerivativesTYPE>(node_->set_input_derivatives, component_, derivative_references_.data(),
                                             node_->degree * n, derivative_orders_.data(), node_->polynomials + n))
    return false;
  if (!degree) {
    std::memcpy(node_->sent, node_->polynomials, bytes);
    node_->has_sent = 1;
  }
  return true;
}

bool Subsystem::sample(double time) {
  current_[0] = time;
  const std::size_t n = node_->outputs;
  double *values = current_.data() + 1, *rates = values + n;
  if (!n) return true;
  if (!call<fmi2GetRealTYPE>(node_->get_real, component_, node_->output_references, n, values) ||
      !all_finite(values, n))
    return false;
  if (!node_->needs_rates) return true;
  return call<fmi2GetRealOutputDerivativesTYPE>(node_->get_output_derivatives, component_, node_->output_references, n,
                                                ones_.data(), rates) &&
         all_finite(rates, n);
}

bool Subsystem::record(double* row) {
  if (!component_ || !node_->recorded) return true;
  return call<fmi2GetRealTYPE>(node_->get_real, component_, node_->recorded_references, node_->recorded, row);
}

bool Subsystem::receive(const TcaGroup* groups, std::size_t size, std::vector<Subsystem>& all, double time,
                        const double* const* newest) {
  for (const TcaGroup* group = groups; group != groups + size; ++group) {
    Subsystem& source = all[group->source];
    if (source.past(2)[0] != time) return false;  // polynomials are about the start of the step
    source.fit(*group, source.past(2), newest ? newest[group->source] : source.current(), time);
    const std::size_t outputs = source.node_->outputs;
    for (std::size_t k = 0; k < group->size; ++k)
      for (int row = 0; row < rows; ++row)
        node_->polynomials[row * node_->inputs + group->inputs[k]] =
            source.polynomial_[row * outputs + group->outputs[k]];
  }
  return true;
}

void Subsystem::fit(const TcaGroup& group, const double* from, const double* to, double time) {
  const std::size_t n = node_->outputs;
  if (group.method == TCA_CUBIC) return fit_cubic(blas_, n, from, to, polynomial_.data());
  std::fill(polynomial_.begin(), polynomial_.end(), 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    const double a = from[1 + k], b = to[1 + k];
    if (group.method == TCA_CONSTANT) {
      polynomial_[k] = b;
      continue;
    }
    const double slope = (b - a) / (to[0] - from[0]);
    polynomial_[n + k] = slope;
    polynomial_[k] = a + slope * (time - from[0]);
  }
}

void Subsystem::accept() {
  const std::size_t size = current_.size();
  std::copy(node_->samples + size, node_->samples + 3 * size, node_->samples);
  std::copy(current_.begin(), current_.end(), node_->samples + 2 * size);
}

}  // namespace engine

void tca_cubic(const TcaBlas* blas, size_t outputs, const double* from, const double* to, double* cubic) {
  engine::fit_cubic(engine::Blas(*blas), outputs, from, to, cubic);
}
