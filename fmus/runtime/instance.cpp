// An instance's life: initialisation, steps, saved states. Its values: values.cpp; model exchange: exchange.cpp.
#include "runtime/instance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/text.hpp"

namespace fmu {

constexpr double kRounding = 4.0 * std::numeric_limits<double>::epsilon();

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
  if (!is_slave) require(model_->check_states().at("no model exchange"));
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
    require(model_->build());
    built_with_ = parameters_;
    progress_.is_initialised = false;
    log_.write(category::events, "built for new parameters");
  }
  if (progress_.is_initialised) return;
  invalidate();
  require(model_->initialise(progress_.time));
  progress_.is_initialised = true;
  if (log_.is_on(category::events)) log_.write(category::events, "initialised at t = " + text(progress_.time) + " s");
}

void Instance::invalidate() { progress_.is_evaluated = has_states_ = has_rates_ = false; }

/// Brings what is calculated up to date.
void Instance::refresh(Causality causality) {
  if (progress_.mode == Mode::initialization) build_and_initialise();
  if (causality == Causality::output && !progress_.is_evaluated) {
    require(model_->evaluate(progress_.time));
    progress_.is_evaluated = true;
  }
  if (causality == Causality::state && !has_states_) {
    std::ranges::fill(states_, 0.0);
    model_->get_states(states_);
    has_states_ = true;
  }
  if (causality == Causality::derivative) refresh_rates();
}

std::string Instance::now() const { return "t = " + text(progress_.time) + " s"; }

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
  const auto fail = [&] {
    std::ranges::copy(memory_before_, model_->memory().begin());
    progress_.mode = Mode::error;
  };
  try {
    result = model_->step(t, h);
  } catch (...) {
    fail();
    throw;
  }
  if (result.status.is_error()) {
    fail();
    throw Error(result.status);
  }
  const bool is_complete = result.reached >= t + h - kRounding * std::max(std::abs(t), h);
  progress_.time = is_complete ? t + h : result.reached;
  progress_.mode = is_complete ? Mode::step_complete : Mode::step_failed;
  invalidate();
  ++progress_.steps;
  advance_inputs(progress_.time - t, is_complete);
  if (!is_complete)
    log_.write(category::discard, "step from " + text(t) + " s by " + text(h) + " s came to " + text(progress_.time) +
                                      " s: " + result.status.text());
  return is_complete;
}

/// Derivatives hold for one step, so a complete one leaves held inputs; what is left of a partial one sees the same
/// polynomial, from its new origin.
void Instance::advance_inputs(double h, bool is_complete) {
  for (const std::size_t index : blueprint_.inputs) {
    const std::ptrdiff_t place = blueprint_.rows[index].place;
    const auto u = load<Polynomial>(data(), place);
    store(data(), place, is_complete ? Polynomial{core::value(u, h)} : core::shifted(u, h));
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
  if (snapshot.progress.interface != progress_.interface)
    throw Error("the state was saved by an instance for " +
                std::string(kInterfaceNames[static_cast<std::size_t>(snapshot.progress.interface)]) +
                "; restore it in one of the same interface");
  if (!snapshot.built_with.empty() && snapshot.built_with != built_with_) {
    if (snapshot.built_with.size() != blueprint_.parameters.size())
      throw Error("the state does not fit this FMU's parameters");
    read_parameters(parameters_);
    write_parameters(snapshot.built_with);
    if (const Status status = model_->build(); !status.is_ok()) {
      write_parameters(parameters_);
      throw Error(status);
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
