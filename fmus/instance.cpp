#include "instance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "text.hpp"

namespace fmu {
namespace {

constexpr double kRounding = 4.0 * std::numeric_limits<double>::epsilon();

Access access_of(Type type) {
  if (type == Type::real) return Access::real;
  return type == Type::boolean ? Access::boolean : Access::integer;
}

const char* name_of(Access access) {
  constexpr std::array names{"Real", "Integer", "Boolean"};
  return names[static_cast<std::size_t>(access)];
}

std::string with_unit(double value, const Variable& row) {
  return text(value) + (row.unit.empty() || row.unit == "1" ? "" : " " + row.unit);
}

/// "1 (lumped), 2 (reduced)", "0.001 m to 0.1 m", "at least 0 K", "any finite value".
std::string allowed(const Variable& row) {
  if (row.type == Type::enumeration) {
    std::string list;
    for (std::size_t i = 0; i < row.items.size(); ++i) append(list, std::to_string(i + 1) + " (" + row.items[i] + ")");
    return list;
  }
  const bool has_least = std::isfinite(row.least), has_most = std::isfinite(row.most);
  if (has_least && has_most) return with_unit(row.least, row) + " to " + with_unit(row.most, row);
  if (has_least) return "at least " + with_unit(row.least, row);
  if (has_most) return "at most " + with_unit(row.most, row);
  return "any finite value";
}

}  // namespace

Instance::Instance(const Blueprint& blueprint, Log log)
    : blueprint_(blueprint), log_(std::move(log)), model_(make_model()) {
  const auto data = model_->data();
  start_data_.assign(data.begin(), data.end());
  model_->warn = [this](std::string_view message) {
    warned_ = true;
    log_.write(category::warning, message);
  };
}

void Instance::permit(const Call& call) const {
  if (call.is_allowed(progress_.mode)) return;
  std::string modes;
  for (std::size_t i = 0; i < kModeNames.size(); ++i)
    if (call.is_allowed(static_cast<Mode>(i))) append(modes, kModeNames[i]);
  throw Error("not allowed in state '" + std::string(kModeNames[static_cast<std::size_t>(progress_.mode)]) + "'; " +
              (modes.empty() ? "this FMU does not offer it in any state" : "allowed in: " + modes));
}

// ---------------------------------------------------------------- life cycle

void Instance::setup_experiment(std::optional<double> tolerance, double start, std::optional<double> stop) {
  if (!std::isfinite(start)) throw Error("start time " + text(start) + " s; give a finite time");
  if (stop && !(*stop >= start))
    throw Error("stop time " + text(*stop) + " s; give one that is not before the start time " + text(start) + " s");
  if (const Variable* row = tolerance ? blueprint_.tolerance() : nullptr) {
    check(*row, *tolerance);
    set_value(*row, data(), *tolerance);
  }
  progress_.time = start;
  progress_.stop = stop.value_or(std::numeric_limits<double>::infinity());
}

void Instance::exit_initialization() {
  build_and_initialise();
  progress_.mode = Mode::step_complete;
}

void Instance::reset() {
  std::ranges::copy(start_data_, data());
  progress_ = {};
  log_.write(category::events, "reset to start values");
}

void Instance::build_and_initialise() {
  read_parameters(parameters_);
  if (parameters_ != built_with_) {
    model_->build();
    built_with_ = parameters_;
    progress_.is_initialised = false;
    log_.write(category::events, "built for new parameters");
  }
  if (progress_.is_initialised) return;
  progress_.is_evaluated = false;
  model_->initialise(progress_.time);
  progress_.is_initialised = true;
  if (log_.is_on(category::events)) log_.write(category::events, "initialised at t = " + text(progress_.time) + " s");
}

void Instance::refresh_outputs() {
  if (progress_.mode == Mode::initialization) build_and_initialise();
  if (progress_.is_evaluated) return;
  model_->evaluate(progress_.time);
  progress_.is_evaluated = true;
}

// ---------------------------------------------------------------- values

const Variable& Instance::row(Reference reference, Access access) const {
  if (reference >= blueprint_.rows.size())
    throw Error("unknown value reference " + std::to_string(reference) + "; " + blueprint_.identity.name +
                " has 0 to " + std::to_string(blueprint_.rows.size() - 1));
  const Variable& row = blueprint_.rows[reference];
  if (access_of(row.type) != access)
    throw Error(row.name + " is accessed as " + name_of(access) + "; use the function for " +
                name_of(access_of(row.type)));
  return row;
}

void Instance::check(const Variable& row, double value) const {
  if (row.causality == Causality::output) throw Error(row.name + " is an output and cannot be set");
  if (row.causality == Causality::parameter && !row.is_tunable && !is_starting())
    throw Error(row.name + " is a fixed parameter and cannot be set after initialisation; reset the FMU first");
  if (!std::isfinite(value) || value < row.least || value > row.most)
    throw Error(row.name + " = " + with_unit(value, row) + " refused; allowed: " + allowed(row) +
                "; nothing was changed, set a value in that range");
}

void Instance::mark_changed() {
  progress_.is_evaluated = false;
  if (is_starting()) progress_.is_initialised = false;
}

template <Access access>
void Instance::get(std::span<const Reference> references, ValueOf<access>* values) {
  for (const Reference reference : references) {
    const Variable& variable = row(reference, access);
    if (variable.causality == Causality::output) refresh_outputs();
    if constexpr (access == Access::real)
      *values++ = load<double>(data(), variable.place);
    else
      *values++ = static_cast<int>(value_of(variable, data()));
  }
}

template <Access access>
void Instance::set(std::span<const Reference> references, const ValueOf<access>* values) {
  for (std::size_t i = 0; i < references.size(); ++i) check(row(references[i], access), values[i]);
  for (std::size_t i = 0; i < references.size(); ++i) {
    const Variable& variable = blueprint_.rows[references[i]];
    if (variable.causality == Causality::input)
      store(data(), variable.place, Polynomial{static_cast<double>(values[i])});
    else
      set_value(variable, data(), values[i]);
  }
  mark_changed();
}

template void Instance::get<Access::real>(std::span<const Reference>, double*);
template void Instance::get<Access::integer>(std::span<const Reference>, int*);
template void Instance::get<Access::boolean>(std::span<const Reference>, int*);
template void Instance::set<Access::real>(std::span<const Reference>, const double*);
template void Instance::set<Access::integer>(std::span<const Reference>, const int*);
template void Instance::set<Access::boolean>(std::span<const Reference>, const int*);

void Instance::set_input_derivatives(std::span<const Reference> references, const int* orders, const double* values) {
  for (std::size_t i = 0; i < references.size(); ++i) {
    const Variable& variable = row(references[i], Access::real);
    if (variable.causality != Causality::input)
      throw Error(variable.name + " is no input: it has no input derivatives");
    if (orders[i] < 1 || orders[i] > 3)
      throw Error(variable.name + ": input derivative of order " + std::to_string(orders[i]) + "; allowed: 1 to 3");
    if (!std::isfinite(values[i]))
      throw Error(variable.name + ": derivative of order " + std::to_string(orders[i]) + " = " + text(values[i]) +
                  " refused; give a finite value, nothing was changed");
  }
  for (std::size_t i = 0; i < references.size(); ++i) {
    const std::ptrdiff_t place = blueprint_.rows[references[i]].place;
    store(data(), place + orders[i] * static_cast<std::ptrdiff_t>(sizeof(double)), values[i]);
  }
  mark_changed();
}

void Instance::get_output_derivatives(std::span<const Reference> references, const int* orders, double* values) {
  refresh_outputs();
  for (std::size_t i = 0; i < references.size(); ++i) {
    const Variable& variable = row(references[i], Access::real);
    if (variable.causality != Causality::output || variable.derivative < 0 || orders[i] != 1)
      throw Error(variable.name + ": no derivative of order " + std::to_string(orders[i]) +
                  "; order 1 is offered for those outputs that are states of the model");
    values[i] = load<double>(data(), variable.derivative);
  }
}

// ---------------------------------------------------------------- stepping

void Instance::check_step(double t, double h) const {
  if (!std::isfinite(h) || h <= 0.0)
    throw Error("communication step size " + text(h) + " s; give a finite one above 0");
  // Hosts sum their steps in different ways: the rounding of every step so far may have piled up in either clock.
  const double steps = static_cast<double>(progress_.steps + 1);
  const double rounding = kRounding * steps * std::max({std::abs(progress_.time), std::abs(t), h});
  if (!std::isfinite(t) || std::abs(t - progress_.time) > rounding)
    throw Error("communication point " + text(t) + " s, but this instance is at " + text(progress_.time) +
                " s; step from there or restore a state of that time");
  if (t + h > progress_.stop + kRounding * steps * std::max(std::abs(progress_.stop), h))
    throw Error("the step ends at " + text(t + h) + " s, after the stop time " + text(progress_.stop) +
                " s of fmi2SetupExperiment; step no further or set up without a stop time");
}

bool Instance::step(double t, double h) {
  check_step(t, h);
  const auto memory = model_->memory();
  memory_before_.assign(memory.begin(), memory.end());
  StepResult result;
  try {
    result = model_->step(t, h);
  } catch (...) {
    std::ranges::copy(memory_before_, model_->memory().begin());
    progress_.mode = Mode::error;
    throw;
  }
  const bool is_complete = result.reached >= t + h - kRounding * std::max(std::abs(t), h);
  progress_.time = is_complete ? t + h : result.reached;
  progress_.mode = is_complete ? Mode::step_complete : Mode::step_failed;
  progress_.is_evaluated = false;
  ++progress_.steps;
  advance_inputs(progress_.time - t, is_complete);
  if (!is_complete)
    log_.write(category::discard, "step from " + text(t) + " s by " + text(h) + " s came to " + text(progress_.time) +
                                      " s: " + result.reason);
  return is_complete;
}

/// Derivatives hold for one step, so a complete one leaves held inputs; what is left of a partial one sees the same
/// polynomial, from its new origin.
void Instance::advance_inputs(double h, bool is_complete) {
  for (const std::size_t index : blueprint_.inputs) {
    const std::ptrdiff_t place = blueprint_.rows[index].place;
    const auto [u, du, ddu, dddu] = load<Polynomial>(data(), place);
    Polynomial moved{u + h * (du + h / 2 * (ddu + h / 3 * dddu))};
    if (!is_complete) moved = {moved[0], du + h * (ddu + h / 2 * dddu), ddu + h * dddu, dddu};
    store(data(), place, moved);
  }
}

// ---------------------------------------------------------------- state

void Instance::read_parameters(std::vector<double>& values) {
  values.clear();
  for (const std::size_t index : blueprint_.parameters) values.push_back(value_of(blueprint_.rows[index], data()));
}

void Instance::write_parameters(std::span<const double> values) {
  for (std::size_t i = 0; i < values.size(); ++i)
    set_value(blueprint_.rows[blueprint_.parameters[i]], data(), values[i]);
}

void Instance::save(Snapshot& snapshot) {
  const auto data = model_->data();
  snapshot.progress = progress_;
  snapshot.data.assign(data.begin(), data.end());
  snapshot.built_with = built_with_;
  const auto memory = progress_.is_initialised ? model_->memory() : std::span<double>{};
  snapshot.memory.assign(memory.begin(), memory.end());
}

void Instance::restore(const Snapshot& snapshot) {
  if (!snapshot.built_with.empty() && snapshot.built_with != built_with_) {
    if (snapshot.built_with.size() != blueprint_.parameters.size())
      throw Error("the state does not fit this FMU's parameters");
    read_parameters(parameters_);
    write_parameters(snapshot.built_with);
    try {
      model_->build();
    } catch (...) {
      write_parameters(parameters_);
      throw;
    }
    built_with_ = snapshot.built_with;
    log_.write(category::events, "built for the parameters of a restored state");
  }
  if (snapshot.progress.is_initialised) {
    if (snapshot.memory.size() != model_->memory().size()) {
      progress_.mode = Mode::error;
      throw Error("the state has " + std::to_string(snapshot.memory.size()) + " remembered numbers, the model " +
                  std::to_string(model_->memory().size()) + "; was it saved by another version of this FMU?");
    }
    std::ranges::copy(snapshot.memory, model_->memory().begin());
  }
  std::ranges::copy(snapshot.data, data());
  progress_ = snapshot.progress;
}

Snapshot* Instance::add(std::unique_ptr<Snapshot> snapshot) { return states_.emplace_back(std::move(snapshot)).get(); }

Snapshot& Instance::find(const void* state) const {
  const auto found = std::ranges::find(states_, state, &std::unique_ptr<Snapshot>::get);
  if (found == states_.end())
    throw Error("unknown FMU state; pass one that this instance gave out and that was not freed");
  return **found;
}

void Instance::remove(const void* state) {
  find(state);
  std::erase_if(states_, [state](const auto& snapshot) { return snapshot.get() == state; });
}

Snapshot Instance::deserialise(std::span<const std::byte> bytes) {
  return fmu::deserialise(blueprint_, bytes, model_->data());
}

}  // namespace fmu
