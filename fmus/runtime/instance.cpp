// An instance's life: initialisation and saved states. Its steps: stepping.cpp; values: values.cpp; model exchange:
// exchange.cpp.
#include "runtime/instance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "model/text.hpp"

namespace fmu {

Instance::Instance(std::shared_ptr<const Blueprint> blueprint, Interface interface, Log log)
    : owner_(std::move(blueprint)),
      blueprint_(*owner_),
      log_(std::move(log)),
      model_(make_model(blueprint_.configuration)),
      input_rates_(blueprint_.inputs.size(), 0.0),
      has_new_derivatives_(blueprint_.rows.size(), false),
      states_(blueprint_.model_states),
      rates_(blueprint_.model_states) {
  progress_.interface = interface;
  const auto data = model_->data();
  write_starts(blueprint_.rows, data.data());
  mark_outputs_unwritten(blueprint_.rows, data.data());
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
  if (tolerance) use_tolerance(*tolerance);
  progress_.time = progress_.start = start;
  progress_.stop = stop.value_or(std::numeric_limits<double>::infinity());
}

/// The standard's tolerance is a hint: it sets the parameter unless the host set that itself, to the nearest value that
/// is allowed.
void Instance::use_tolerance(double asked) {
  if (!std::isfinite(asked) || asked <= 0.0)
    throw Error("tolerance " + text(asked) + "; give a finite one above 0, or leave it undefined");
  const Variable* row = blueprint_.tolerance();
  if (!row) return;
  if (progress_.is_tolerance_set) {
    log_.write(category::events, "tolerance " + text(asked) +
                                     " of fmi2SetupExperiment is not used: parameter tolerance = " +
                                     text(value_of(*row, data())) + " was set explicitly");
    return;
  }
  const double nearest = std::clamp(asked, row->least, row->most);
  set_value(*row, data(), nearest);
  if (nearest != asked)
    log_.write(category::events, "tolerance " + text(asked) + " of fmi2SetupExperiment: allowed is " +
                                     text(row->least) + " to " + text(row->most) + ", the nearest is used");
}

void Instance::exit_initialization() {
  build_and_initialise();
  const bool is_slave = progress_.interface == Interface::co_simulation;
  if (!is_slave) require(check_states().at("no model exchange"));
  progress_.mode = is_slave ? Mode::step_complete : Mode::event;
}

void Instance::reset() {
  std::ranges::copy(start_data_, data());
  progress_ = {.interface = progress_.interface};
  std::ranges::fill(input_rates_, 0.0);
  invalidate();
  log_.write(category::events, "reset to start values");
}

void Instance::build_and_initialise() {
  read_parameters(parameters_);
  if (parameters_ != built_with_) {
    build();
    built_with_ = parameters_;
    progress_.is_initialised = false;
    log_.write(category::events, "built for new parameters");
  }
  if (progress_.is_initialised) return;
  invalidate();
  model_->warnings_given = 0;
  require(model_->initialise(progress_.time));
  progress_.is_initialised = true;
  if (log_.is_on(category::events)) log_.write(category::events, "initialised at t = " + text(progress_.time) + " s");
}

/// Builds the model for its present parameters. Throws Error, with the model as it was.
void Instance::build() {
  require(model_->build());
  mark_outputs_unwritten(blueprint_.rows, data());
  missing_state_.clear();
  if (!blueprint_.configuration.has_moving_states_only || !model_->check_states().is_ok()) return;
  std::vector<bool> moving = moving_states(*model_, blueprint_.model_states);
  for (const std::size_t state : blueprint_.states) moving[blueprint_.rows[state].offset] = false;
  const auto missing = std::ranges::find(moving, true);
  if (missing == moving.end()) return;
  const auto all = variables(blueprint_.configuration);
  auto row = std::ranges::find(all, Causality::state, &Variable::causality);
  missing_state_ = row[missing - moving.begin()].name;
}

/// Success when the host can integrate: the model has states, and all that move are declared.
Status Instance::check_states() const {
  if (missing_state_.empty()) return model_->check_states();
  return Status::error(missing_state_ + " moves at these parameters, but this FMU was written without it",
                       "keep the level of detail that it was written for, or write it anew with the parameters wanted");
}

void Instance::invalidate() {
  progress_.is_evaluated = has_states_ = has_rates_ = model_->is_same_point = false;
  progress_.parts = 0;
}

/// Brings what is calculated up to date.
void Instance::refresh(Causality causality) {
  if (progress_.mode == Mode::initialization) build_and_initialise();
  if (causality == Causality::output && !progress_.is_evaluated) {
    // A host of model exchange tries points that no trajectory passes through: they deserve no warning, and hosts that
    // take a warning for a failure, as CasADi does, could not use the values.
    const bool is_trial = progress_.mode == Mode::event || progress_.mode == Mode::continuous;
    const bool was_silent = std::exchange(model_->is_silent, model_->is_silent || is_trial);
    Status status = model_->evaluate(progress_.time);
    model_->is_silent = was_silent;
    require_now(std::move(status));
    progress_.is_evaluated = model_->is_same_point = true;
  }
  if (causality == Causality::state && !has_states_) {
    std::ranges::fill(states_, 0.0);
    model_->get_states(states_);
    has_states_ = true;
  }
  if (causality == Causality::derivative) refresh_rates();
}

/// Brings the outputs up to date that are calculated only where a host asks for them.
void Instance::refresh_on_demand(unsigned parts) {
  const unsigned missing = parts & ~progress_.parts;
  if (!missing) return;
  require_now(model_->evaluate_on_demand(progress_.time, missing));
  progress_.parts |= missing;
  model_->is_same_point = true;
}

void Instance::require_now(Status status) {
  if (!status.is_ok()) require(std::move(status).at(now()));
}

std::string Instance::now() const { return "t = " + text(progress_.time) + " s"; }

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
  snapshot.progress.warnings_given = model_->warnings_given;
  snapshot.input_rates = input_rates_;
  snapshot.is_foreign = false;
  snapshot.data.assign(data.begin(), data.end());
  snapshot.built_with = built_with_;
  const auto memory = progress_.is_initialised ? model_->memory() : std::span<double>{};
  snapshot.memory.assign(memory.begin(), memory.end());
}

void Instance::restore(const Snapshot& snapshot) {
  model_->is_same_point = false;
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
      build();
    } catch (const Error&) {
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
    if (snapshot.is_foreign) require(model_->check_memory(snapshot.memory).as_error());
    std::ranges::copy(snapshot.memory, model_->memory().begin());
  }
  std::ranges::copy(snapshot.data, data());
  progress_ = snapshot.progress;
  model_->warnings_given = progress_.warnings_given;
  input_rates_ = snapshot.input_rates;
  input_rates_.resize(blueprint_.inputs.size(), 0.0);
  has_new_derivatives_.assign(has_new_derivatives_.size(), false);
  has_states_ = has_rates_ = false;
}

Snapshot* Instance::add(std::unique_ptr<Snapshot> snapshot) { return saved_.emplace_back(std::move(snapshot)).get(); }

Snapshot& Instance::find(const void* state) const {
  const auto saved = std::ranges::find(saved_, state, &std::unique_ptr<Snapshot>::get);
  if (saved == saved_.end())
    throw Error("unknown FMU state; pass one that this instance gave out and that was not freed");
  return **saved;
}

void Instance::remove(const void* state) {
  find(state);
  std::erase_if(saved_, [state](const auto& snapshot) { return snapshot.get() == state; });
}

Snapshot Instance::deserialise(std::span<const std::byte> bytes) {
  return fmu::deserialise(blueprint_, bytes, model_->data());
}

}  // namespace fmu
