// What all instances of one FMU share: identity, variable table, GUID, and access to the value behind a row.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstring>
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
  std::string guid;                     // hash of modelDescription.xml but for the GUID itself

  /// The one of this FMU, made at first use and constant from then on. Throws Error when the table contradicts itself.
  static const Blueprint& get();

  /// The parameter that the standard's tolerance of an experiment sets, null where the model has none.
  const Variable* tolerance() const;
};

/// Whether the host may give the row a value.
inline bool has_start(const Variable& row) {
  return row.causality == Causality::parameter || row.causality == Causality::input;
}

/// Whether the row is an input or state that a dependency on `name` means.
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
