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

Instance::Instance(const Blueprint& blueprint, Interface interface, Log log)
    : blueprint_(blueprint),
      log_(std::move(log)),
      model_(make_model()),
      states_(blueprint.states.size()),
      rates_(blueprint.states.size()) {
  progress_.interface = interface;
  const auto data = model_->data();
  start_data_.assign(data.begin(), data.end());
  model_->warn = [this](std::string_view message) {
    warned_ = true;
    log_.write(category::warning, message);
  };
}

void Instance::permit(const Call& call) const {
  const Interface interface = progress_.interface;
  if (call.is_allowed(interface, progress_.mode)) return;
  std::string modes;
  for (std::size_t i = 0; i < kModeNames.size(); ++i)
    if (call.is_allowed(interface, static_cast<Mode>(i))) append(modes, kModeNames[i]);
  throw Error("not allowed in state '" + std::string(kModeNames[static_cast<std::size_t>(progress_.mode)]) + "'; " +
              (modes.empty() ? "an instance for " + std::string(kInterfaceNames[static_cast<std::size_t>(interface)]) +
                                   " does not offer it in any state"
                             : "allowed in: " + modes));
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
  const bool is_slave = progress_.interface == Interface::co_simulation;
  if (const std::string reason = model_->without_states(); !is_slave && !reason.empty())
    throw Error("no model exchange: " + reason);
  progress_.mode = is_slave ? Mode::step_complete : Mode::event;
}

void Instance::reset() {
  std::ranges::copy(start_data_, data());
  progress_ = {.interface = progress_.interface};
  invalidate();
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
  invalidate();
  model_->initialise(progress_.time);
  progress_.is_initialised = true;
  if (log_.is_on(category::events)) log_.write(category::events, "initialised at t = " + text(progress_.time) + " s");
}

void Instance::invalidate() { progress_.is_evaluated = has_states_ = has_rates_ = false; }

/// Brings what is calculated up to date.
void Instance::refresh(Causality causality) {
  if (progress_.mode == Mode::initialization) build_and_initialise();
  if (causality == Causality::output && !progress_.is_evaluated) {
    model_->evaluate(progress_.time);
    progress_.is_evaluated = true;
  }
  if (causality == Causality::state && !has_states_) {
    std::ranges::fill(states_, 0.0);
    model_->get_states(states_);
    has_states_ = true;
  }
  if (causality == Causality::derivative)
    if (const std::string reason = refresh_rates(); !reason.empty()) throw Error(reason);
}

/// As refresh, and the reason where there are no derivatives. States that the parameters rule out do not move.
std::string Instance::refresh_rates() {
  if (has_rates_) return {};
  std::ranges::fill(rates_, 0.0);
  std::string reason;
  if (model_->without_states().empty()) reason = model_->rates(progress_.time, rates_);
  has_rates_ = reason.empty();
  return reason;
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
  if (!has_start(row)) throw Error(row.name + " is calculated and cannot be set");
  if (row.causality == Causality::parameter && !row.is_tunable && !is_starting())
    throw Error(row.name + " is a fixed parameter and cannot be set after initialisation; reset the FMU first");
  if (!std::isfinite(value) || value < row.least || value > row.most)
    throw Error(row.name + " = " + with_unit(value, row) + " refused; allowed: " + allowed(row) +
                "; nothing was changed, set a value in that range");
}

void Instance::mark_changed() {
  invalidate();
  if (is_starting()) progress_.is_initialised = false;
}

template <Access access>
void Instance::get(std::span<const Reference> references, ValueOf<access>* values) {
  for (const Reference reference : references) {
    const Variable& variable = row(reference, access);
    if (!has_start(variable)) refresh(variable.causality);
    if constexpr (access == Access::real)
      *values++ = variable.causality == Causality::state        ? states_[variable.place]
                  : variable.causality == Causality::derivative ? rates_[variable.place]
                                                                : load<double>(data(), variable.place);
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
  refresh(Causality::output);
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
  invalidate();
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

// ---------------------------------------------------------------- model exchange

void Instance::set_time(double t) {
  if (!std::isfinite(t)) throw Error("time " + text(t) + " s; give a finite time");
  progress_.time = t;
  invalidate();
}

void Instance::need_states(std::size_t count) const {
  if (count != states_.size())
    throw Error("room for " + std::to_string(count) + " states, this FMU has " + std::to_string(states_.size()));
}

void Instance::set_states(std::span<const double> x) {
  need_states(x.size());
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!std::isfinite(x[i]))
      throw Error(blueprint_.rows[blueprint_.states[i]].name + " = " + text(x[i]) +
                  " refused; give a finite value, nothing was changed");
  model_->set_states(x);
  invalidate();
}

void Instance::get_states(std::span<double> x) {
  need_states(x.size());
  refresh(Causality::state);
  std::ranges::copy(states_, x.begin());
}

void Instance::get_nominals(std::span<double> x) const {
  need_states(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = blueprint_.rows[blueprint_.states[i]].typical;
}

bool Instance::get_derivatives(std::span<double> dx) {
  need_states(dx.size());
  const std::string reason = refresh_rates();
  if (!reason.empty()) {
    log_.write(category::discard, "derivatives at t = " + text(progress_.time) + " s: " + reason);
    return false;
  }
  std::ranges::copy(rates_, dx.begin());
  return true;
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
  if (snapshot.progress.interface != progress_.interface)
    throw Error("the state was saved by an instance for " +
                std::string(kInterfaceNames[static_cast<std::size_t>(snapshot.progress.interface)]) +
                "; restore it in one of the same interface");
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
  has_states_ = has_rates_ = false;
}

Snapshot* Instance::add(std::unique_ptr<Snapshot> snapshot) { return saved_.emplace_back(std::move(snapshot)).get(); }

Snapshot& Instance::find(const void* state) const {
  const auto found = std::ranges::find(saved_, state, &std::unique_ptr<Snapshot>::get);
  if (found == saved_.end())
    throw Error("unknown FMU state; pass one that this instance gave out and that was not freed");
  return **found;
}

void Instance::remove(const void* state) {
  find(state);
  std::erase_if(saved_, [state](const auto& snapshot) { return snapshot.get() == state; });
}

Snapshot Instance::deserialise(std::span<const std::byte> bytes) {
  return fmu::deserialise(blueprint_, bytes, model_->data());
}

}  // namespace fmu
