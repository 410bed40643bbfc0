// The variable table of an FMU: one row per variable, declared once. Value, start, type and offset all follow from a
// member of the model's data struct; from the rows come get and set, modelDescription.xml and the GUID.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "model/configuration.hpp"
#include "model/model.hpp"

namespace fmu {

enum class Type { real, integer, boolean, enumeration };
enum class Causality { parameter, input, output, state, derivative };

struct Variable {
  std::string name;
  std::string unit;  // a unit that units.hpp knows; empty for integers, Booleans and enumerations
  std::string description;
  Type type = Type::real;
  Causality causality = Causality::parameter;
  std::ptrdiff_t offset = 0;  // byte offset from the start of Model::data(); states and derivatives: index of the state
  std::ptrdiff_t derivative = -1;  // outputs: byte offset of the first time derivative, -1 where none is offered
  double start = 0.0;              // of inputs and parameters, read from the default-constructed data struct
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  double typical = 1.0;            // FMI nominal
  bool is_tunable = false;         // parameters: may change after initialisation
  bool is_retuned = false;         // tunable parameters: a change asks for Model::retune
  std::vector<std::string> items;  // enumerations: item k has the value k + 1
  // Outputs and derivatives: inputs and states that act at once, by name, or by the name of a vector for all of it.
  std::vector<std::string> depends_on;
  std::string rate_unit;  // states: of the time derivative
  // States: inputs that determine the value at the start, by name as in depends_on. Unset: all of them.
  std::optional<std::vector<std::string>> start_depends_on;
  // Parameters that set several members: byte offsets of the others, and the share of the value that each member gets.
  std::vector<std::ptrdiff_t> also;
  double share = 1.0;
  unsigned part = 0;  // outputs: bits of Model::evaluate_on_demand that write it where a host asks; 0: evaluate()
  bool is_difference =
      false;  // FMI relativeQuantity: a difference, to which the offset of a display unit does not apply

  // Refinements of a row, to be chained behind Table::parameter, input and output.
  Variable& range(double low, double high) { return least = low, most = high, *this; }
  Variable& nominal(double value) { return typical = value, *this; }
  Variable& tunable() { return is_tunable = true, *this; }
  Variable& retuned() { return is_tunable = is_retuned = true, *this; }
  Variable& choices(std::vector<std::string> names) { return items = std::move(names), *this; }
  Variable& depends(std::vector<std::string> names) { return depends_on = std::move(names), *this; }
  Variable& starts_from(std::vector<std::string> names) { return start_depends_on = std::move(names), *this; }
  Variable& on_demand(unsigned bits = 1) { return part = bits, *this; }
  Variable& difference() { return is_difference = true, *this; }
};

/// "T", 0 -> "T[1]": the structured name of the index-th (from 0) element.
inline std::string indexed(const std::string& name, std::size_t index) {
  return name + "[" + std::to_string(index + 1) + "]";
}

/// Builds rows from references into one default-constructed data struct (kept by the caller while rows are added).
template <class Data>
class Table {
 public:
  explicit Table(const Data& defaults) : base_(reinterpret_cast<const std::byte*>(&defaults)) {}

  template <class Member>
  Variable& parameter(std::string name, const Member& member, std::string unit, std::string description) {
    return add(Causality::parameter, std::move(name), member, std::move(unit), std::move(description));
  }
  Variable& input(std::string name, const Polynomial& member, std::string unit, std::string description) {
    return add(Causality::input, std::move(name), member[0], std::move(unit), std::move(description));
  }
  template <class Member>
  Variable& output(std::string name, const Member& member, std::string unit, std::string description) {
    return add(Causality::output, std::move(name), member, std::move(unit), std::move(description));
  }
  /// An output with its first time derivative.
  Variable& output(std::string name, const double& member, const double& rate, std::string unit,
                   std::string description) {
    Variable& row = output(std::move(name), member, std::move(unit), std::move(description));
    row.derivative = offset_of(rate);
    return row;
  }

  /// Setting this parameter sets that member too.
  template <class Member>
  void also(Variable& row, const Member& member) const {
    row.also.push_back(offset_of(member));
  }

  /// A continuous state and its derivative der(name), which is what depends() is about.
  Variable& state(std::string name, std::string unit, std::string rate_unit, std::string description) {
    Variable& row = rows_.emplace_back();
    row.name = std::move(name);
    row.unit = std::move(unit);
    row.rate_unit = std::move(rate_unit);
    row.description = std::move(description);
    row.causality = Causality::state;
    row.offset = states_++;
    return row;
  }

  std::vector<Variable> rows() && { return std::move(rows_); }

 private:
  template <class Member>
  std::ptrdiff_t offset_of(const Member& member) const {
    return reinterpret_cast<const std::byte*>(&member) - base_;
  }

  template <class Member>
  Variable& add(Causality causality, std::string name, const Member& member, std::string unit,
                std::string description) {
    static_assert(std::is_same_v<Member, double> || std::is_same_v<Member, int> || std::is_same_v<Member, bool> ||
                  std::is_enum_v<Member>);
    Variable& row = rows_.emplace_back();
    row.name = std::move(name);
    row.unit = std::move(unit);
    row.description = std::move(description);
    row.causality = causality;
    row.offset = offset_of(member);
    row.start = static_cast<double>(member);
    if constexpr (std::is_same_v<Member, int>) row.type = Type::integer;
    if constexpr (std::is_same_v<Member, bool>) row.type = Type::boolean;
    if constexpr (std::is_enum_v<Member>) {
      static_assert(sizeof(Member) == sizeof(int), "an enumeration is kept as an int whose first item is 1");
      row.type = Type::enumeration;
    }
    return row;
  }

  const std::byte* base_;
  std::vector<Variable> rows_;
  std::ptrdiff_t states_ = 0;
};

/// Name and default experiment of an FMU; each FMU folder defines identity(), variables() and make_model() in
/// table.cpp.
struct Identity {
  std::string name;         // modelName and modelIdentifier
  std::string description;  // one line
  double stop_time = 30.0;  // default experiment [s]
  double step_size = 0.1;   // [s]
};
Identity identity();
/// All rows at that size, whatever start values and states the configuration asks for: the blueprint sees to those.
std::vector<Variable> variables(const Configuration& configuration);
std::unique_ptr<Model> make_model(const Configuration& configuration);

}  // namespace fmu
