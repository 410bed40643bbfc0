#include "description/blueprint.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cinttypes>
#include <cstdio>
#include <set>

#include "core/spin_lock.hpp"
#include "core/unwritten.hpp"
#include "description/description.hpp"
#include "model/hash.hpp"
#include "model/text.hpp"

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

/// The start value of a row from its text: a number, true or false, or an enumeration's item.
double read_start(const Variable& row, const std::string& value) {
  if (row.type == Type::boolean && (value == "true" || value == "false")) return value == "true" ? 1.0 : 0.0;
  const auto item = std::ranges::find(row.items, value);
  if (item != row.items.end()) return static_cast<double>(item - row.items.begin() + 1);
  double number = 0.0;
  const auto [end, failure] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (failure != std::errc() || end != value.data() + value.size() || !is_in_range(row, number)) {
    std::string allowed = text(row.least) + " to " + text(row.most);
    for (const std::string& name : row.items) append(allowed, name);
    throw Error("configuration: start value '" + value + "' of " + row.name + " refused; allowed: " + allowed);
  }
  return number;
}

/// Sets the start values in the order of the rows, so that a parameter of one element overrides that of all.
void set_starts(std::vector<Variable>& rows, const Configuration& configuration) {
  if (configuration.starts.empty()) return;
  for (const Start& start : configuration.starts) {
    const auto row = std::ranges::find(rows, start.name, &Variable::name);
    if (row == rows.end() || !has_start(*row))
      throw Error("configuration: '" + start.name + "' is no parameter or input of this FMU at tcas = " +
                  std::to_string(configuration.tcas) + ", segments = " + std::to_string(configuration.segments));
  }
  const auto model = make_model(configuration);
  std::byte* data = model->data().data();
  for (const Variable& row : rows) {
    const auto start = std::ranges::find(configuration.starts, row.name, &Start::name);
    if (start != configuration.starts.end()) set_value(row, data, read_start(row, start->value));
  }
  for (Variable& row : rows)
    if (has_start(row)) row.start = value_of(row, data);
}

/// Inputs that act on some state, by the names that the table uses.
std::vector<std::string> acting_inputs(const std::vector<Variable>& rows) {
  std::vector<std::string> names;
  for (const Variable& state : rows) {
    if (state.causality != Causality::state) continue;
    for (const std::string& name : state.depends_on) {
      const bool is_input = std::ranges::any_of(
          rows, [&](const Variable& row) { return row.causality == Causality::input && acts_as(row, name); });
      if (is_input && std::ranges::find(names, name) == names.end()) names.push_back(name);
    }
  }
  return names;
}

/// Leaves the states alone that move at the start values, and takes the others out of the lists of dependencies. Where
/// none moves, as in a static model, what depended on states depends on the inputs at once. Returns whether a host can
/// integrate the model.
bool keep_moving_states(std::vector<Variable>& rows, const Configuration& configuration, std::size_t count) {
  const auto model = make_model(configuration);
  write_starts(rows, model->data().data());
  require(model->build().at("configuration: the start values"));
  std::vector<bool> moving(count, false);
  const bool has_states = model->check_states().is_ok();
  if (has_states) moving = moving_states(*model, count);
  const bool is_static = std::ranges::find(moving, true) == moving.end();
  const std::vector<std::string> inputs = is_static ? acting_inputs(rows) : std::vector<std::string>{};
  std::erase_if(rows, [&](const Variable& row) { return row.causality == Causality::state && !moving[row.offset]; });
  const auto is_gone = [&](const std::string& name) {
    return std::ranges::none_of(rows, [&](const Variable& known) { return acts_as(known, name); });
  };
  for (Variable& row : rows) {
    if (std::erase_if(row.depends_on, is_gone) > 0)
      for (const std::string& name : inputs)
        if (std::ranges::find(row.depends_on, name) == row.depends_on.end()) row.depends_on.push_back(name);
    if (row.start_depends_on) std::erase_if(*row.start_depends_on, is_gone);
  }
  return has_states;
}

Blueprint make(const Configuration& configuration) {
  Blueprint blueprint;
  blueprint.identity = identity();
  blueprint.configuration = configuration;
  blueprint.rows = variables(configuration);
  for (Variable& row : blueprint.rows) {
    if (row.type == Type::boolean) row.range(0.0, 1.0);
    if (row.type == Type::enumeration) row.range(1.0, static_cast<double>(row.items.size()));
  }
  check_table(blueprint.rows);  // at build time already: describe_<name> comes by here too
  set_starts(blueprint.rows, configuration);
  blueprint.model_states =
      static_cast<std::size_t>(std::ranges::count(blueprint.rows, Causality::state, &Variable::causality));
  if (configuration.has_moving_states_only)
    blueprint.has_model_exchange = keep_moving_states(blueprint.rows, configuration, blueprint.model_states);
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

void write_starts(const std::vector<Variable>& rows, std::byte* data) {
  for (const Variable& row : rows)
    if (has_start(row)) set_value(row, data, row.start);
}

void mark_outputs_unwritten(const std::vector<Variable>& rows, std::byte* data) {
  for (const Variable& row : rows) {
    if (row.causality != Causality::output || row.type != Type::real) continue;
    store(data, row.offset, core::kUnwritten);
    if (row.derivative >= 0) store(data, row.derivative, core::kUnwritten);
  }
}

std::vector<bool> moving_states(Model& model, std::size_t count) {
  // A state that the parameters do not need reads as 0 whatever is written. The numbers differ, so that no projection
  // on a plane of motion takes them all to 0 by chance.
  constexpr double kSize = 1e-3;
  std::vector<double> written(count), read(count, 0.0);
  for (std::size_t k = 0; k < count; ++k) written[k] = kSize * (1.0 + std::sin(static_cast<double>(k + 1)) / 2.0);
  model.set_states(written);
  model.get_states(read);
  std::vector<bool> moving(count);
  for (std::size_t k = 0; k < count; ++k) moving[k] = read[k] != 0.0;
  return moving;
}

const Blueprint& Blueprint::get() {
  static const Blueprint blueprint = make({});
  return blueprint;
}

std::shared_ptr<const Blueprint> Blueprint::of(const Configuration& configuration) {
  if (configuration == Configuration()) return {std::shared_ptr<const Blueprint>(), &get()};
  // Whoever makes one instance after another finds the last one still there; those of a sweep do not pile up.
  static std::atomic_flag is_taken;
  static std::vector<std::weak_ptr<const Blueprint>> in_use;
  static std::shared_ptr<const Blueprint> last;
  const core::SpinLock lock(is_taken);
  std::erase_if(in_use, [](const auto& each) { return each.expired(); });
  for (const auto& each : in_use)
    if (auto blueprint = each.lock(); blueprint && blueprint->configuration == configuration) return last = blueprint;
  last = std::make_shared<const Blueprint>(make(configuration));
  in_use.push_back(last);
  return last;
}

}  // namespace fmu
