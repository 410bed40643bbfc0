// An instance's life: initialisation, steps, saved states. Its values: values.cpp; model exchange: exchange.cpp.
#include "runtime/instance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/text.hpp"

namespace fmu {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kRounding = 4.0 * kEpsilon;  // of one sum of times, relative
constexpr double kShare = 0.01;               // of a step: most by which a communication point may be off
constexpr double kLeastUlps = 8.0;            // least step, in units of rounding of the time
// Steps outside of these have no use; their powers, which models form, would overflow [s].
constexpr double kLeastStep = 1e-40, kMostStep = 1e40;

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

void Instance::invalidate() { progress_.is_evaluated = has_states_ = has_rates_ = has_demanded_ = false; }

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
    progress_.is_evaluated = true;
  }
  if (causality == Causality::state && !has_states_) {
    std::ranges::fill(states_, 0.0);
    model_->get_states(states_);
    has_states_ = true;
  }
  if (causality == Causality::derivative) refresh_rates();
}

/// Brings the outputs up to date that are calculated only where a host asks for them.
void Instance::refresh_on_demand() {
  if (has_demanded_) return;
  require_now(model_->evaluate_on_demand(progress_.time));
  has_demanded_ = true;
}

void Instance::require_now(Status status) {
  if (!status.is_ok()) require(std::move(status).at(now()));
}

std::string Instance::now() const { return "t = " + text(progress_.time) + " s"; }

// ---------------------------------------------------------------- stepping

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

/// Fails where the polynomial of an input leaves the input's range during the step.
Status Instance::check_inputs(double h) const {
  for (const std::size_t index : blueprint_.inputs) {
    const Variable& row = blueprint_.rows[index];
    const auto u = load<Polynomial>(model_->data().data(), row.offset);
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
  advance_inputs(progress_.time - t, is_complete);
  if (!is_complete) return discard_step(t, h, result.status);
  progress_.mode = Mode::step_complete;
  return true;
}

/// Derivatives hold for one step, so a complete one leaves held inputs; what is left of a partial one sees the same
/// polynomial, from its new origin.
void Instance::advance_inputs(double h, bool is_complete) {
  for (std::size_t i = 0; i < blueprint_.inputs.size(); ++i) {
    const std::ptrdiff_t offset = blueprint_.rows[blueprint_.inputs[i]].offset;
    const auto u = load<Polynomial>(data(), offset);
    input_rates_[i] = core::rate(u, h);
    store(data(), offset, is_complete ? Polynomial{core::value(u, h)} : core::shifted(u, h));
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
  snapshot.progress.warnings_given = model_->warnings_given;
  snapshot.input_rates = input_rates_;
  snapshot.is_foreign = false;
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
  has_states_ = has_rates_ = has_demanded_ = false;
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
