// An instance's states and their rates, for a host that integrates them (model exchange).
#include <algorithm>
#include <cmath>
#include <utility>

#include "model/text.hpp"
#include "runtime/instance.hpp"

namespace fmu {

// Share of the run by which a host may look past the stop time: integrators such as CVODE step over the last output
// point and interpolate back (FMPy's by up to a fiftieth of the run). The standard wants times after it refused
// (2.1.6).
constexpr double kPastStop = 0.1;

/// Brings rates_ up to date. States that the present parameters do not need have the rate 0.
void Instance::refresh_rates() {
  if (has_rates_) return;
  std::ranges::fill(rates_, 0.0);
  if (check_states().is_ok()) require_now(model_->rates(progress_.time, rates_));
  has_rates_ = true;
}

void Instance::set_time(double t) {
  if (!std::isfinite(t)) throw Error("time " + text(t) + " s; give a finite time");
  if (t > progress_.stop + kPastStop * (progress_.stop - progress_.start))
    throw Error("time " + text(t) + " s is after the stop time " + text(progress_.stop) +
                " s of fmi2SetupExperiment; go no further or set up without a stop time");
  progress_.time = t;
  invalidate();
}

void Instance::need_states(std::size_t count) const {
  if (count != blueprint_.states.size())
    throw Error("room for " + std::to_string(count) + " states, this FMU has " +
                std::to_string(blueprint_.states.size()));
}

void Instance::set_states(std::span<const double> x) {
  need_states(x.size());
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!std::isfinite(x[i]))
      throw Error(blueprint_.rows[blueprint_.states[i]].name + " = " + text(x[i]) +
                  " refused; give a finite value, nothing was changed");
  for (std::size_t i = 0; i < x.size(); ++i) states_[blueprint_.rows[blueprint_.states[i]].offset] = x[i];
  model_->set_states(states_);
  invalidate();
}

std::span<const double> Instance::present_inputs() {
  inputs_.clear();
  for (const std::size_t index : blueprint_.inputs) inputs_.push_back(value_of(blueprint_.rows[index], data()));
  return inputs_;
}

bool Instance::complete_step() {
  require_now(model_->complete_step().as_error());
  if (std::exchange(model_->has_held_back, false)) require_now(model_->evaluate(progress_.time).as_error());
  return input_watch_.complete_step(present_inputs());
}

void Instance::get_states(std::span<double> x) {
  need_states(x.size());
  refresh(Causality::state);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = states_[blueprint_.rows[blueprint_.states[i]].offset];
}

void Instance::get_nominals(std::span<double> x) const {
  need_states(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = blueprint_.rows[blueprint_.states[i]].typical;
}

void Instance::get_derivatives(std::span<double> dx) {
  need_states(dx.size());
  if (progress_.mode == Mode::continuous) input_watch_.evaluate(progress_.time, present_inputs());
  refresh(Causality::derivative);
  for (std::size_t i = 0; i < dx.size(); ++i) {
    const Variable& row = blueprint_.rows[blueprint_.states[i]];
    dx[i] = finite(row, rates_[row.offset]);
  }
}

}  // namespace fmu
