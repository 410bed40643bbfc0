// Data shared by all instances of one FMU: identity, variable table, GUID; and access to the value behind a row.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "model/model.hpp"
#include "model/table.hpp"

namespace fmu {

struct Blueprint {
  Identity identity;
  std::vector<Variable> rows;           // the value reference of a variable is its place in here
  std::vector<std::size_t> parameters;  // rows that are parameters
  std::vector<std::size_t> inputs;      // rows that are inputs
  std::vector<std::size_t> states;      // rows that are states; their derivatives are the last rows, in the same order
  std::size_t tolerance_row = static_cast<std::size_t>(-1);
  std::string guid;  // hash of modelDescription.xml but for the GUID itself

  /// The one of this FMU, made at first use and constant from then on. Throws Error when the table contradicts itself.
  static const Blueprint& get();

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

/// Throws Error on contradictions in a table that the compiler cannot see, such as a name declared twice.
void check_table(const std::vector<Variable>& rows);

template <class Value>
Value load(const std::byte* data, std::ptrdiff_t place) {
  Value value;
  std::memcpy(&value, data + place, sizeof(Value));
  return value;
}

template <class Value>
void store(std::byte* data, std::ptrdiff_t place, Value value) {
  std::memcpy(data + place, &value, sizeof(Value));
}

/// The value of a row of any type as a double.
inline double value_of(const Variable& row, const std::byte* data) {
  switch (row.type) {
    case Type::real:
      return load<double>(data, row.place);
    case Type::boolean:
      return load<bool>(data, row.place);
    case Type::integer:
    case Type::enumeration:
      return load<int>(data, row.place);
  }
  return std::nan("");
}

inline void set_value(const Variable& row, std::byte* data, double value) {
  switch (row.type) {
    case Type::real:
      return store(data, row.place, value);
    case Type::boolean:
      return store(data, row.place, value != 0.0);
    case Type::integer:
    case Type::enumeration:
      return store(data, row.place, static_cast<int>(value));
  }
}

}  // namespace fmu
