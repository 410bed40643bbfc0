// Data shared by all instances of one FMU: identity, configuration, variable table, GUID; and access to the value
// behind a row.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "model/model.hpp"
#include "model/table.hpp"

namespace fmu {

struct Blueprint {
  Identity identity;
  Configuration configuration;
  std::vector<Variable> rows;           // the value reference of a variable is its index in here
  std::vector<std::size_t> parameters;  // rows that are parameters
  std::vector<std::size_t> inputs;      // rows that are inputs
  std::vector<std::size_t> states;      // rows that are states; their derivatives are the last rows, in the same order
  std::size_t tolerance_row = static_cast<std::size_t>(-1);
  std::string guid;  // hash of modelDescription.xml but for the GUID itself

  bool has_model_exchange = true;  // false: written for a level of detail that a host cannot integrate

  std::size_t model_states = 0;  // states of the model; the configuration may leave out those that do not move

  /// The one of the default configuration, made at first use and constant from then on. Throws Error when the table
  /// contradicts itself.
  static const Blueprint& get();

  /// The one of that configuration, shared by all who hold it. Throws Error when it names what the table does not have.
  static std::shared_ptr<const Blueprint> of(const Configuration& configuration);

  /// The parameter that the tolerance of fmi2SetupExperiment sets; null where the model has none.
  const Variable* tolerance() const { return tolerance_row < rows.size() ? &rows[tolerance_row] : nullptr; }
};

/// True for rows to which the host may give a value: parameters and inputs.
inline bool has_start(const Variable& row) {
  return row.causality == Causality::parameter || row.causality == Causality::input;
}

/// True for a value that is finite, within the range of the row and, unless the row is real, an integer.
inline bool is_in_range(const Variable& row, double value) {
  if (!std::isfinite(value) || value < row.least || value > row.most) return false;
  return row.type == Type::real || (value == std::floor(value) && std::abs(value) <= std::numeric_limits<int>::max());
}

/// is_in_range with room for the rounding of a polynomial that ends at a limit.
inline bool is_in_widened_range(const Variable& row, double value) {
  constexpr double kRounding = 1e-12;  // relative
  return std::isfinite(value) && value >= row.least - kRounding * std::abs(row.least) &&
         value <= row.most + kRounding * std::abs(row.most);
}

/// True for an input or state that `name` in a list of dependencies refers to.
bool acts_as(const Variable& known, std::string_view name);

/// Writes the start values of all rows that have one into the model's data.
void write_starts(const std::vector<Variable>& rows, std::byte* data);

/// Writes core::kUnwritten into all outputs and their rates.
void mark_outputs_unwritten(const std::vector<Variable>& rows, std::byte* data);

/// Which of the `count` states of a model that was built the present parameters let move; the others stay 0. Leaves
/// other values in the model's memory.
std::vector<bool> moving_states(Model& model, std::size_t count);

/// Throws Error on contradictions in a table that the compiler cannot see, such as a name declared twice.
void check_table(const std::vector<Variable>& rows);

template <class Value>
Value load(const std::byte* data, std::ptrdiff_t offset) {
  Value value;
  std::memcpy(&value, data + offset, sizeof(Value));
  return value;
}

template <class Value>
void store(std::byte* data, std::ptrdiff_t offset, Value value) {
  std::memcpy(data + offset, &value, sizeof(Value));
}

/// The value of a row of any type as a double.
inline double value_of(const Variable& row, const std::byte* data) {
  switch (row.type) {
    case Type::real:
      return load<double>(data, row.offset) / row.share;
    case Type::boolean:
      return load<bool>(data, row.offset);
    case Type::integer:
    case Type::enumeration:
      return load<int>(data, row.offset);
  }
  return std::nan("");
}

inline void set_member(const Variable& row, std::byte* data, std::ptrdiff_t offset, double value) {
  switch (row.type) {
    case Type::real:
      return store(data, offset, value * row.share);
    case Type::boolean:
      return store(data, offset, value != 0.0);
    case Type::integer:
    case Type::enumeration:
      return store(data, offset, static_cast<int>(value));
  }
}

inline void set_value(const Variable& row, std::byte* data, double value) {
  set_member(row, data, row.offset, value);
  for (const std::ptrdiff_t offset : row.also) set_member(row, data, offset, value);
}

}  // namespace fmu
