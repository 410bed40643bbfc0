// Getting and setting an instance's values: which variable a reference names, which numbers it takes, and when.
#include <array>
#include <cmath>

#include "core/unwritten.hpp"
#include "model/text.hpp"
#include "runtime/instance.hpp"

namespace fmu {
namespace {

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

void Instance::refuse(Reference reference, Access access) const {
  if (reference >= blueprint_.rows.size())
    throw Error("unknown value reference " + std::to_string(reference) + "; " + blueprint_.identity.name +
                " has 0 to " + std::to_string(blueprint_.rows.size() - 1));
  const Variable& row = blueprint_.rows[reference];
  throw Error(row.name + " is accessed as " + name_of(access) + "; use the function for " +
              name_of(access_of(row.type)));
}

void Instance::check(const Variable& row, double value) const {
  if (row.causality == Causality::output) throw Error(row.name + " is an output and cannot be set");
  const bool may_set_states = progress_.mode == Mode::event || progress_.mode == Mode::continuous;
  if (row.causality == Causality::state ? !may_set_states : !has_start(row))
    throw Error(row.name + " is calculated and cannot be set" +
                (row.causality == Causality::state ? " now; hosts set states in event and continuous-time mode" : ""));
  if (row.causality == Causality::parameter && !row.is_tunable && !is_starting())
    throw Error(row.name + " is a fixed parameter and cannot be set after initialisation; reset the FMU first");
  if (!is_in_range(row, value))
    throw Error(row.name + " = " + with_unit(value, row) + " refused; allowed: " + allowed(row) +
                "; nothing was changed, set a value in that range");
}

void Instance::refuse(const Variable& row, double value) const {
  if (core::is_unwritten(value))
    throw Error(now() + ": " + row.name + " is not calculated with these parameters, a fault of " +
                blueprint_.identity.name + ".fmu; report it, and read no " + row.name + " until it is mended");
  throw Error(now() + ": " + row.name + " is not finite; inputs or states are beyond the model's range, reduce them",
              core::Severity::discard);
}

void Instance::mark_changed() {
  invalidate();
  if (is_starting()) progress_.is_initialised = false;
}

template <Access access>
void Instance::get(std::span<const Reference> references, ValueOf<access>* values) {
  std::array<bool, static_cast<std::size_t>(Causality::derivative) + 1> is_read{};
  unsigned parts = 0;
  for (const Reference reference : references) {  // all are checked before anything is calculated
    const Variable& variable = row(reference, access);
    is_read[static_cast<std::size_t>(variable.causality)] = true;
    parts |= variable.part;
  }
  for (const Causality causality : {Causality::output, Causality::state, Causality::derivative})
    if (is_read[static_cast<std::size_t>(causality)]) refresh(causality);
  refresh_on_demand(parts);
  const std::byte* data = this->data();
  for (const Reference reference : references) {
    const Variable& variable = blueprint_.rows[reference];
    if constexpr (access == Access::real) {
      const double value = variable.causality == Causality::state        ? states_[variable.offset]
                           : variable.causality == Causality::derivative ? rates_[variable.offset]
                                                                         : value_of(variable, data);
      *values++ = finite(variable, value);
    } else {
      *values++ = static_cast<int>(value_of(variable, data));
    }
  }
}

template <Access access>
void Instance::set(std::span<const Reference> references, const ValueOf<access>* values) {
  bool has_set_states = false, has_retuned = false, has_parameters = false;
  for (std::size_t i = 0; i < references.size(); ++i) {
    const Variable& variable = row(references[i], access);
    check(variable, values[i]);
    has_parameters = has_parameters || variable.causality == Causality::parameter;
  }
  if (has_parameters && !is_starting()) read_parameters(parameters_);
  for (std::size_t i = 0; i < references.size(); ++i) {
    const Variable& variable = blueprint_.rows[references[i]];
    if (variable.causality == Causality::input) {
      set_input(references[i], static_cast<double>(values[i]));
    } else if (variable.causality == Causality::state) {
      refresh(Causality::state);
      states_[variable.offset] = static_cast<double>(values[i]);
      has_set_states = true;
    } else {
      has_retuned =
          has_retuned || (variable.is_retuned &&
                          (!variable.also.empty() || value_of(variable, data()) != static_cast<double>(values[i])));
      set_value(variable, data(), values[i]);
      if (&variable == blueprint_.tolerance()) progress_.is_tolerance_set = true;
    }
  }
  if (has_set_states) model_->set_states(states_);
  mark_changed();
  if (has_retuned && !is_starting()) retune(parameters_);
}

/// Brings the model up to date with tunable parameters that changed. Throws Error and puts back the parameters `before`
/// where it cannot be.
void Instance::retune(std::span<const double> before) {
  if (const Status status = model_->retune(progress_.time); !status.is_ok()) {
    write_parameters(before);
    throw Error(status);
  }
  for (std::size_t i = 0; i < built_with_.size(); ++i)
    if (const Variable& row = blueprint_.rows[blueprint_.parameters[i]]; row.is_retuned)
      built_with_[i] = value_of(row, data());
}

/// Sets the value and leaves derivatives that were set for the coming step, in whichever order the calls come. What is
/// left of the polynomial of a step that came part of the way ends here.
void Instance::set_input(Reference reference, double value) {
  const std::ptrdiff_t offset = blueprint_.rows[reference].offset;
  auto u = load<Polynomial>(data(), offset);
  if (progress_.mode == Mode::step_failed && !has_new_derivatives_[reference]) u = {};
  u[0] = value;
  store(data(), offset, u);
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
      throw Error(variable.name + " is not an input: it has no input derivatives");
    if (orders[i] < 1 || orders[i] > 3)
      throw Error(variable.name + ": input derivative of order " + std::to_string(orders[i]) + "; allowed: 1 to 3");
    if (!std::isfinite(values[i]))
      throw Error(variable.name + ": derivative of order " + std::to_string(orders[i]) + " = " + text(values[i]) +
                  " refused; give a finite value, nothing was changed");
  }
  for (std::size_t i = 0; i < references.size(); ++i) {
    const std::ptrdiff_t offset = blueprint_.rows[references[i]].offset;
    auto u = load<Polynomial>(data(), offset);
    if (progress_.mode == Mode::step_failed && !has_new_derivatives_[references[i]]) u = {u[0]};
    has_new_derivatives_[references[i]] = true;
    u[static_cast<std::size_t>(orders[i])] = values[i];
    store(data(), offset, u);
  }
  mark_changed();
}

void Instance::get_output_derivatives(std::span<const Reference> references, const int* orders, double* values) {
  std::vector<Reference> others;  // outputs whose rate the model does not write
  unsigned parts = 0;             // that write the rates of the others
  for (std::size_t i = 0; i < references.size(); ++i) {
    const Variable& variable = row(references[i], Access::real);
    if (variable.causality != Causality::output)
      throw Error(variable.name + " is not an output: it has no output derivatives");
    if (orders[i] < 1)
      throw Error(variable.name + ": output derivative of order " + std::to_string(orders[i]) + "; allowed: from 1 on");
    if (orders[i] > 1) continue;
    if (variable.derivative < 0)
      others.push_back(references[i]);
    else
      parts |= variable.part;
  }
  std::vector<double> rates(others.size());
  if (!others.empty()) output_rates(others, rates.data());
  refresh(Causality::output);
  refresh_on_demand(parts);
  auto next = rates.begin();
  for (std::size_t i = 0; i < references.size(); ++i) {
    const Variable& variable = blueprint_.rows[references[i]];
    if (orders[i] > 1)
      values[i] = 0.0;  // beyond maxOutputDerivativeOrder, as the standard asks (2.0.4, section 4.2.1)
    else
      values[i] = finite(variable, variable.derivative < 0 ? *next++ : load<double>(data(), variable.derivative));
  }
}

}  // namespace fmu
