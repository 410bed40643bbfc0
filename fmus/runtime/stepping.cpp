// Communication steps of an instance: what may be asked for, and what a step that was cut short leaves behind.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "model/text.hpp"
#include "runtime/instance.hpp"

namespace fmu {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kRounding = 4.0 * kEpsilon;  // of one sum of times, relative
constexpr double kShare = 0.01;               // of a step: most by which a communication point may be off
constexpr double kLeastUlps = 8.0;            // least step, in units of rounding of the time
// Steps outside of these have no use; their powers, which models form, would overflow [s].
constexpr double kLeastStep = 1e-40, kMostStep = 1e40;

void Instance::check_step(double t, double h) const {
  if (!(h >= kLeastStep && h <= kMostStep))
    throw Error("communication step size " + text(h) + " s; allowed: " + text(kLeastStep) + " s to " + text(kMostStep) +
                " s");
  const double clock = std::max(std::abs(progress_.time), std::abs(t)), ulp = kEpsilon * clock;
  if (h < kLeastUlps * ulp)
    throw Error("communication step size " + text(h) + " s is below the rounding of the time at t = " + text(t) +
                " s; take steps of at least " + text(kLeastUlps * ulp) + " s, or start the clock near 0");
  // Hosts sum their steps in different ways: the rounding of every step so far may have accumulated in either clock,
  // but never to more than a share of this step.
  const auto allowed = [&](double scale) {
    const double accumulated = kRounding * static_cast<double>(progress_.steps + 1) * std::max(scale, h);
    return std::min(accumulated, std::max(kShare * h, 2.0 * kEpsilon * scale));
  };
  if (!std::isfinite(t) || std::abs(t - progress_.time) > allowed(clock))
    throw Error("communication point " + text(t) + " s, but this instance is at " + text(progress_.time) +
                " s; step from there or restore a state of that time");
  if (t + h > progress_.stop + allowed(std::abs(progress_.stop)))
    throw Error("the step ends at " + text(t + h) + " s, after the stop time " + text(progress_.stop) +
                " s of fmi2SetupExperiment; step no further or set up without a stop time");
}

bool Instance::are_inputs_constant() const {
  const std::byte* const data = model_->data().data();
  return std::ranges::all_of(blueprint_.inputs, [&](std::size_t index) {
    return core::is_constant(load<Polynomial>(data, blueprint_.rows[index].offset));
  });
}

/// Fails where the polynomial of an input leaves the input's range during the step.
Status Instance::check_inputs(double h) const {
  const std::byte* const data = model_->data().data();
  for (const std::size_t index : blueprint_.inputs) {
    const Variable& row = blueprint_.rows[index];
    const auto u = load<Polynomial>(data, row.offset);
    if (core::is_constant(u)) continue;
    const auto [least, most] = core::extremes(u, h);
    if (is_in_widened_range(row, least) && is_in_widened_range(row, most)) continue;
    return Status::discard("the derivatives of input " + row.name + " take it from " + text(u[0]) + " to between " +
                               text(least) + " and " + text(most) + " during the step, allowed is " + text(row.least) +
                               " to " + text(row.most),
                           "set smaller derivatives or ask for a smaller step");
  }
  return {};
}

/// Leaves a step that came to progress_.time only.
bool Instance::discard_step(double t, double h, const Status& status) {
  progress_.mode = Mode::step_failed;
  has_new_derivatives_.assign(has_new_derivatives_.size(), false);
  log_.write(category::discard, "step from " + text(t) + " s by " + text(h) + " s came to " + text(progress_.time) +
                                    " s: " + status.text());
  return false;
}

bool Instance::step(double t, double h) {
  check_step(t, h);
  const bool are_constant = are_inputs_constant();
  if (!are_constant)
    if (const Status status = check_inputs(h); !status.is_ok()) return discard_step(t, h, status);
  const auto memory = model_->memory();
  memory_before_.assign(memory.begin(), memory.end());
  const auto put_back = [&] { std::ranges::copy(memory_before_, model_->memory().begin()); };
  StepResult result;
  try {
    result = model_->step(t, h);
  } catch (...) {
    put_back();
    progress_.mode = Mode::error;
    throw;
  }
  if (result.status.is_error()) {
    put_back();
    progress_.mode = Mode::error;
    throw Error(result.status);
  }
  const bool is_complete = result.status.is_ok();
  if (!is_complete && result.reached <= t) put_back();
  progress_.time = is_complete ? t + h : std::max(t, result.reached);
  progress_.last_step = h;
  ++progress_.steps;
  invalidate();
  if (are_constant)
    std::ranges::fill(input_rates_, 0.0);
  else
    advance_inputs(progress_.time - t, is_complete);
  if (!is_complete) return discard_step(t, h, result.status);
  model_->is_same_point = true;
  progress_.mode = Mode::step_complete;
  return true;
}

/// Derivatives hold for one step, so a complete one leaves held inputs; what is left of a partial one sees the same
/// polynomial, from its new origin.
void Instance::advance_inputs(double h, bool is_complete) {
  std::byte* const data = this->data();
  for (std::size_t i = 0; i < blueprint_.inputs.size(); ++i) {
    const std::ptrdiff_t offset = blueprint_.rows[blueprint_.inputs[i]].offset;
    const auto u = load<Polynomial>(data, offset);
    if (core::is_constant(u)) {
      input_rates_[i] = 0.0;
      continue;
    }
    input_rates_[i] = core::rate(u, h);
    store(data, offset, is_complete ? Polynomial{core::value(u, h)} : core::shifted(u, h));
  }
}

}  // namespace fmu
