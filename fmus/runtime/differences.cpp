// Directional derivatives of any model: of rates by the model itself where it offers that, of all else by central
// differences of order 4 at the points -2, -1, 1, 2 of an increment, behind a Model::retune at each of them where
// tunable parameters move:
//   f' = (8 (f_1 - f_-1) - (f_2 - f_-2)) / 12 s + O(s^4 f^(5)).
// Truncation and rounding meet at s = eps^(1/5) of the scale on which f bends, about 1e-12 of the result: as good as a
// host's solver can use, in four evaluations and without a second program text for each model. The increment is a power
// of two, so that linear models are differentiated to rounding. The scale of a variable is its value or its nominal,
// whichever is larger.
#include <algorithm>
#include <cmath>

#include "runtime/instance.hpp"

namespace fmu {
namespace {

constexpr double kIncrement = 0x1p-10;  // of the scale; eps^(1/5) is 2^-10.4
struct Pair {
  double at, weight;
};
constexpr std::array<Pair, 2> kPairs{{{1.0, 8.0 / 12}, {2.0, -1.0 / 12}}};

}  // namespace

void Instance::move(const Variable& known, double change) {
  if (known.causality == Causality::state) {
    refresh(Causality::state);
    states_[known.offset] += change;
    model_->set_states(states_);
    invalidate();
    has_states_ = true;
    return;
  }
  set_value(known, data(), value_of(known, data()) + change);
  mark_changed();
}

/// Whether a derivative by this variable is defined now.
bool Instance::is_known(const Variable& variable) const {
  switch (variable.causality) {
    case Causality::input:
      return true;
    case Causality::parameter:
      return progress_.mode == Mode::initialization || variable.is_tunable;
    case Causality::state:
      return progress_.mode != Mode::initialization;
    default:
      return false;
  }
}

/// Makes the direction that of the inputs' first time derivatives.
void Instance::aim(std::span<const Reference> knowns, const double* known) {
  constexpr auto kFirst = static_cast<std::ptrdiff_t>(sizeof(double));
  for (const std::size_t index : blueprint_.inputs) store(data(), blueprint_.rows[index].offset + kFirst, 0.0);
  for (std::size_t i = 0; i < knowns.size(); ++i) {
    const Variable& variable = blueprint_.rows[knowns[i]];
    if (variable.causality == Causality::input) store(data(), variable.offset + kFirst, known[i]);
  }
}

/// The model's own derivatives of the rates; empty where it has none. The direction is aimed at.
std::vector<double> Instance::rates_along(std::span<const Reference> knowns, const double* known) {
  std::vector<double> dx(states_.size()), ddx(states_.size());
  for (std::size_t i = 0; i < knowns.size(); ++i) {
    const Variable& variable = blueprint_.rows[knowns[i]];
    if (variable.causality == Causality::state) dx[variable.offset] = known[i];
  }
  if (!check_states().is_ok() || !model_->rates_along(progress_.time, dx, ddx)) ddx.clear();
  return ddx;
}

void Instance::directional_derivative(std::span<const Reference> unknowns, std::span<const Reference> knowns,
                                      const double* known, double* unknown) {
  const bool is_starting = progress_.mode == Mode::initialization;
  for (const Reference reference : unknowns) {
    const Variable& variable = row(reference, Access::real);
    if (has_start(variable) || (variable.causality == Causality::state && !is_starting))
      throw Error(variable.name + " is not an unknown here; ask for outputs and derivatives of states");
  }
  double step = std::numeric_limits<double>::infinity();
  bool is_retuned = false;
  for (std::size_t i = 0; i < knowns.size(); ++i) {
    const Variable& variable = row(knowns[i], Access::real);
    if (!is_known(variable))
      throw Error(variable.name + " is not known here; known are inputs, and parameters while the instance is " +
                  "initialised, states and tunable parameters later");
    if (!std::isfinite(known[i])) throw Error("the direction is not finite in " + variable.name);
    double value = 0.0;
    get<Access::real>({&knowns[i], 1}, &value);
    is_retuned = is_retuned || (variable.is_retuned && !is_starting && known[i] != 0.0);
    if (known[i] != 0.0)
      step = std::min(step, kIncrement * std::max(std::abs(value), variable.typical) / std::abs(known[i]));
  }
  std::fill_n(unknown, unknowns.size(), 0.0);
  if (std::isinf(step)) return;
  step = std::exp2(std::floor(std::log2(step)));

  Snapshot here;
  save(here);
  std::vector<double> exact, drift(model_->memory().size());
  bool is_drifting = false;
  if (!is_starting && !is_retuned) {  // the model's own derivatives know nothing of parameters
    aim(knowns, known);
    exact = rates_along(knowns, known);
    is_drifting = model_->drift(drift);
  }
  restore(here);
  const auto is_exact = [&](Reference reference) {
    return !exact.empty() && blueprint_.rows[reference].causality == Causality::derivative;
  };
  for (std::size_t i = 0; i < unknowns.size(); ++i)
    if (is_exact(unknowns[i])) unknown[i] = exact[blueprint_.rows[unknowns[i]].offset];
  if (std::ranges::all_of(unknowns, is_exact)) return;

  std::vector<double> ahead(unknowns.size()), behind(unknowns.size());
  model_->is_silent = true;
  const auto evaluate_at = [&](double distance, std::vector<double>& values) {
    read_parameters(parameters_);
    for (std::size_t i = 0; i < knowns.size(); ++i) move(blueprint_.rows[knowns[i]], distance * known[i]);
    if (is_retuned) retune(parameters_);
    for (std::size_t i = 0; is_drifting && i < drift.size(); ++i) model_->memory()[i] += distance * drift[i];
    get<Access::real>(unknowns, values.data());
    restore(here);
  };
  try {
    for (const Pair& pair : kPairs) {
      evaluate_at(pair.at * step, ahead);
      evaluate_at(-pair.at * step, behind);
      for (std::size_t i = 0; i < unknowns.size(); ++i)
        if (!is_exact(unknowns[i])) unknown[i] += pair.weight / step * (ahead[i] - behind[i]);
    }
  } catch (...) {
    restore(here);
    model_->is_silent = false;
    throw;
  }
  model_->is_silent = false;
}

/// Time derivatives of outputs at the end of the last step, where inputs go on at the rates that they had there: the
/// derivative along states and inputs of a model with states, else what steps onwards show.
void Instance::output_rates(std::span<const Reference> references, double* rates) {
  std::vector<Reference> knowns;
  std::vector<double> direction;
  for (std::size_t i = 0; i < blueprint_.inputs.size(); ++i)
    if (input_rates_[i] != 0.0) {
      knowns.push_back(static_cast<Reference>(blueprint_.inputs[i]));
      direction.push_back(input_rates_[i]);
    }
  if (check_states().is_ok()) {
    refresh(Causality::derivative);
    for (const std::size_t state : blueprint_.states) {
      const double rate = rates_[blueprint_.rows[state].offset];
      if (rate == 0.0) continue;
      knowns.push_back(static_cast<Reference>(state));
      direction.push_back(rate);
    }
    directional_derivative(references, knowns, direction.data(), rates);
  } else {
    step_rates(references, rates);
  }
}

/// The slope at 0 of the parabola through outputs now and after one and two short steps.
void Instance::step_rates(std::span<const Reference> references, double* rates) {
  constexpr double kPart = 1e-3;   // of the last step
  constexpr double kFirst = 1e-6;  // before there was one [s]
  const double h = kPart * (progress_.last_step > 0.0 ? progress_.last_step : kFirst / kPart);
  constexpr std::array<double, 3> kWeights{-1.5, 2.0, -0.5};
  Snapshot here;
  save(here);
  model_->is_silent = true;
  std::fill_n(rates, references.size(), 0.0);
  std::vector<double> values(references.size());
  Status status;
  try {
    for (std::size_t k = 0; k < kWeights.size() && status.is_ok(); ++k) {
      if (k > 0) {
        for (std::size_t i = 0; i < blueprint_.inputs.size(); ++i) {
          const std::ptrdiff_t offset = blueprint_.rows[blueprint_.inputs[i]].offset;
          const double value =
              load<double>(here.data.data(), offset) + static_cast<double>(k - 1) * h * input_rates_[i];
          store(data(), offset, Polynomial{value, input_rates_[i]});
        }
        status = model_->step(progress_.time + static_cast<double>(k - 1) * h, h).status;
        advance_inputs(h, true);
        invalidate();
      }
      get<Access::real>(references, values.data());
      for (std::size_t i = 0; i < references.size(); ++i) rates[i] += kWeights[k] / h * values[i];
    }
  } catch (...) {
    restore(here);
    model_->is_silent = false;
    throw;
  }
  restore(here);
  model_->is_silent = false;
  require(std::move(status).at("output derivatives"));
}

}  // namespace fmu
