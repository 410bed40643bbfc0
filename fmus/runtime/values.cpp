// Getting and setting an instance's values: which variable a reference names, which numbers it takes, and when.
#include <array>
#include <cmath>

#include "model/text.hpp"
#include "runtime/instance.hpp"

namespace fmu {
namespace {

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

}  // namespace fmu
