#include "description/blueprint.hpp"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <set>

#include "description/description.hpp"
#include "model/hash.hpp"

namespace fmu {
namespace {

/// 128 bits as {8-4-4-4-12} hexadecimal digits.
std::string guid_of(const std::string& text) {
  const std::uint64_t high = hash(text), low = hash(text, high);
  std::array<char, 40> guid{};
  std::snprintf(guid.data(), guid.size(), "{%08" PRIx64 "-%04" PRIx64 "-%04" PRIx64 "-%04" PRIx64 "-%012" PRIx64 "}",
                high >> 32, high >> 16 & 0xffff, high & 0xffff, low >> 48, low & 0xffffffffffff);
  return guid.data();
}

Variable derivative_of(Variable& state) {
  Variable row = state;
  row.name = "der(" + state.name + ")";
  row.unit = state.rate_unit;
  row.description = "Time derivative of " + state.name;
  row.causality = Causality::derivative;
  row.rate_unit.clear();
  row.typical = 1.0;
  state.depends_on.clear();  // they were its derivative's
  return row;
}

Blueprint make() {
  Blueprint blueprint;
  blueprint.identity = identity();
  blueprint.rows = variables();
  for (Variable& row : blueprint.rows) {
    if (row.type == Type::boolean) row.range(0.0, 1.0);
    if (row.type == Type::enumeration) row.range(1.0, static_cast<double>(row.items.size()));
  }
  check_table(blueprint.rows);  // at build time already: describe_<name> comes by here too
  for (std::size_t i = 0; i < blueprint.rows.size(); ++i) {
    if (blueprint.rows[i].causality == Causality::state) blueprint.states.push_back(i);
    if (blueprint.rows[i].causality == Causality::parameter) blueprint.parameters.push_back(i);
    if (blueprint.rows[i].name == "tolerance" && blueprint.rows[i].causality == Causality::parameter)
      blueprint.tolerance_row = i;
    if (blueprint.rows[i].causality == Causality::input) blueprint.inputs.push_back(i);
  }
  for (const std::size_t state : blueprint.states) blueprint.rows.push_back(derivative_of(blueprint.rows[state]));
  blueprint.guid = guid_of(model_description(blueprint));
  return blueprint;
}

}  // namespace

void check_table(const std::vector<Variable>& rows) {
  std::set<std::string> names;
  for (const Variable& row : rows) {
    if (!names.insert(row.name).second) throw Error("variable table: '" + row.name + "' is declared twice");
    if (has_start(row) && !(row.start >= row.least && row.start <= row.most))
      throw Error("variable table: the start value of '" + row.name + "' is out of its own range");
    if (row.is_tunable && row.causality != Causality::parameter)
      throw Error("variable table: '" + row.name + "' is tunable but no parameter");
    if (row.name == "tolerance" && row.type != Type::real)
      throw Error("variable table: 'tolerance' must be real, fmi2SetupExperiment sets it");
    if ((row.type == Type::enumeration) != !row.items.empty())
      throw Error("variable table: '" + row.name + "' needs choices if and only if it is an enumeration");
    if ((row.type == Type::real) != !row.unit.empty())
      throw Error("variable table: '" + row.name + "' needs a unit if and only if it is real");
    if ((row.causality == Causality::state) != !row.rate_unit.empty())
      throw Error("variable table: '" + row.name + "' needs a unit of its rate if and only if it is a state");
  }
  for (const Variable& row : rows) {
    std::vector<std::string> named = row.depends_on;
    if (row.start_depends_on) named.insert(named.end(), row.start_depends_on->begin(), row.start_depends_on->end());
    for (const std::string& name : named)
      if (std::ranges::none_of(rows, [&](const Variable& known) { return acts_as(known, name); }))
        throw Error("variable table: '" + row.name + "' depends on '" + name +
                    "', which is neither an input nor a state");
  }
}

bool acts_as(const Variable& known, std::string_view name) {
  if (known.causality != Causality::input && known.causality != Causality::state) return false;
  return known.name == name || (known.name.starts_with(name) && known.name[name.size()] == '[');
}

const Blueprint& Blueprint::get() {
  static const Blueprint blueprint = make();
  return blueprint;
}

}  // namespace fmu
