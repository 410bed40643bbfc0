#include "description/description.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "description/log_categories.hpp"
#include "description/units.hpp"
#include "model/text.hpp"

namespace fmu {
namespace {

/// ` name="value"`
std::string attribute(std::string_view name, std::string_view value) {
  return " " + std::string(name) + "=\"" + escaped(value) + "\"";
}

std::string attribute(std::string_view name, double value) { return attribute(name, text(value)); }
std::string attribute(std::string_view name, const char* value) { return attribute(name, std::string_view(value)); }
std::string attribute(std::string_view name, bool value) { return attribute(name, value ? "true" : "false"); }

/// The interfaces that the start values allow, with what they share.
std::string interfaces(const Identity& identity, bool has_model_exchange) {
  const std::string shared = attribute("canBeInstantiatedOnlyOncePerProcess", false) +
                             attribute("canNotUseMemoryManagementFunctions", true) +
                             attribute("canGetAndSetFMUstate", true) + attribute("canSerializeFMUstate", true) +
                             attribute("providesDirectionalDerivative", true) + "/>\n";
  const std::string name = attribute("modelIdentifier", identity.name);
  return (has_model_exchange ? "  <ModelExchange" + name + shared : std::string()) + "  <CoSimulation" + name +
         attribute("canHandleVariableCommunicationStepSize", true) + attribute("canInterpolateInputs", true) +
         attribute("maxOutputDerivativeOrder", 1.0) + shared;
}

std::string unit_definitions(const std::vector<Variable>& rows) {
  std::set<std::string> units;
  for (const Variable& row : rows)
    if (!row.unit.empty()) units.insert(row.unit);
  std::string result = "  <UnitDefinitions>\n";
  for (const std::string& unit : units) {
    result += "    <Unit" + attribute("name", unit) + ">\n      <BaseUnit";
    const BaseUnit exponents = base_unit(unit);
    for (std::size_t i = 0; i < exponents.size(); ++i)
      if (exponents[i] != 0) result += attribute(kBaseUnits[i], static_cast<double>(exponents[i]));
    result += "/>\n";
    for (const DisplayUnit& display : kDisplayUnits) {
      if (display.unit != unit) continue;
      result += "      <DisplayUnit" + attribute("name", display.name) + attribute("factor", display.factor) +
                attribute("offset", display.offset) + "/>\n";
    }
    result += "    </Unit>\n";
  }
  return result + "  </UnitDefinitions>\n";
}

/// One type per enumeration variable; the standard wants a name that no variable has.
std::string type_name(const Variable& row) { return row.name + "_choices"; }

std::string type_definitions(const std::vector<Variable>& rows) {
  std::string types;
  for (const Variable& row : rows) {
    if (row.type != Type::enumeration) continue;
    types += "    <SimpleType" + attribute("name", type_name(row)) + ">\n      <Enumeration>\n";
    for (std::size_t i = 0; i < row.items.size(); ++i)
      types +=
          "        <Item" + attribute("name", row.items[i]) + attribute("value", static_cast<double>(i + 1)) + "/>\n";
    types += "      </Enumeration>\n    </SimpleType>\n";
  }
  return types.empty() ? types : "  <TypeDefinitions>\n" + types + "  </TypeDefinitions>\n";
}

std::string log_categories() {
  std::string result = "  <LogCategories>\n";
  for (const Category& kind : category::kAll)
    result += "    <Category" + attribute("name", kind.name) + attribute("description", kind.description) + "/>\n";
  return result + "    <Category" + attribute("name", category::kEverything) +
         attribute("description", "All of the above") + "/>\n  </LogCategories>\n";
}

std::string default_experiment(const Blueprint& blueprint) {
  const Identity& identity = blueprint.identity;
  std::string result = "  <DefaultExperiment" + attribute("startTime", 0.0) + attribute("stopTime", identity.stop_time);
  if (const Variable* tolerance = blueprint.tolerance()) result += attribute("tolerance", tolerance->start);
  return result + attribute("stepSize", identity.step_size) + "/>\n";
}

std::string bounds(const Variable& row) {
  std::string result;
  if (std::isfinite(row.least)) result += attribute("min", row.least);
  if (std::isfinite(row.most)) result += attribute("max", row.most);
  return result;
}

/// The element inside a ScalarVariable that carries what depends on the type.
std::string typed_element(const Variable& row, std::string_view derivative) {
  const std::string start = has_start(row) ? attribute("start", row.start) : "";
  switch (row.type) {
    case Type::real: {
      std::string result = "<Real" + attribute("unit", row.unit);
      if (row.is_difference) result += attribute("relativeQuantity", true);
      for (const DisplayUnit& display : kDisplayUnits)
        if (display.unit == row.unit) result += attribute("displayUnit", display.name);
      result += bounds(row);
      if (row.typical != 1.0) result += attribute("nominal", row.typical);
      return result + start + std::string(derivative) + "/>";
    }
    case Type::integer:
      return "<Integer" + bounds(row) + start + "/>";
    case Type::boolean:
      return "<Boolean" + (has_start(row) ? attribute("start", row.start != 0.0) : "") + "/>";
    case Type::enumeration:
      return "<Enumeration" + attribute("declaredType", type_name(row)) + bounds(row) + start + "/>";
  }
  return {};
}

std::string model_variables(const Blueprint& blueprint) {
  const std::vector<Variable>& rows = blueprint.rows;
  const std::size_t first_derivative = rows.size() - blueprint.states.size();
  std::string result = "  <ModelVariables>\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Variable& row = rows[i];
    std::string role, derivative;
    switch (row.causality) {
      case Causality::parameter:
        role = attribute("causality", "parameter") + attribute("variability", row.is_tunable ? "tunable" : "fixed") +
               attribute("initial", "exact");
        break;
      case Causality::input:
        role = attribute("causality", "input") + attribute("variability", "continuous");
        break;
      case Causality::output:
        role = attribute("causality", "output") +
               attribute("variability", row.type == Type::real ? "continuous" : "discrete") +
               attribute("initial", "calculated");
        break;
      case Causality::derivative:
        derivative = attribute("derivative", static_cast<double>(blueprint.states[i - first_derivative] + 1));
        [[fallthrough]];
      case Causality::state:
        role = attribute("causality", "local") + attribute("variability", "continuous") +
               attribute("initial", "calculated");
        break;
    }
    result += "    <!-- " + std::to_string(i + 1) + " -->\n    <ScalarVariable" + attribute("name", row.name) +
              attribute("valueReference", static_cast<double>(i)) + attribute("description", row.description) + role +
              ">\n      " + typed_element(row, derivative) + "\n    </ScalarVariable>\n";
  }
  return result + "  </ModelVariables>\n";
}

std::string section(const std::string& name, const std::string& unknowns) {
  return unknowns.empty() ? "" : "    <" + name + ">\n" + unknowns + "    </" + name + ">\n";
}

/// The rows of inputs and states that a name in a list of dependencies means; each name is looked up once, for a table
/// of a long body has thousands of rows with the same lists.
class Actors {
 public:
  explicit Actors(const std::vector<Variable>& rows) : rows_(rows) {}

  const std::vector<std::size_t>& of(const std::string& name) {
    const auto [rows, is_new] = matches_.try_emplace(name);
    for (std::size_t k = 0; is_new && k < rows_.size(); ++k)
      if (acts_as(rows_[k], name)) rows->second.push_back(k);
    return rows->second;
  }

  void mark(const std::vector<std::string>& names, std::vector<bool>& known) {
    for (const std::string& name : names)
      for (const std::size_t k : of(name)) known[k] = true;
  }

 private:
  const std::vector<Variable>& rows_;
  std::map<std::string, std::vector<std::size_t>> matches_;
};

/// Indices (from 1) of the marked rows, as the attribute wants them.
std::string indices(const std::vector<bool>& known) {
  std::string list;
  for (std::size_t k = 0; k < known.size(); ++k)
    if (known[k]) append(list, std::to_string(k + 1), " ");
  return list;
}

/// The attribute `dependencies` of an initial unknown: all parameters, the inputs that act at once, and those that
/// determine the states that act at once. Empty, which means everything, where a state may start from any input.
std::string initial_dependencies(const std::vector<Variable>& rows, Actors& actors, const Variable& unknown) {
  std::vector<bool> known(rows.size());
  const auto include_start_of = [&](const Variable& state) {
    if (!state.start_depends_on) return false;
    actors.mark(*state.start_depends_on, known);
    return true;
  };
  if (unknown.causality == Causality::state && !include_start_of(unknown)) return {};
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (rows[k].causality == Causality::parameter) known[k] = true;
  for (const std::string& name : unknown.depends_on)
    for (const std::size_t k : actors.of(name)) {
      if (rows[k].causality == Causality::input) known[k] = true;
      if (rows[k].causality == Causality::state && !include_start_of(rows[k])) return {};
    }
  return attribute("dependencies", indices(known));
}

/// Exact dependencies of outputs, derivatives and initial values: a host would otherwise see algebraic loops that do
/// not exist (FMI 2.0.4, section 2.2.8).
std::string model_structure(const std::vector<Variable>& rows) {
  std::string outputs, derivatives, initial;
  Actors actors(rows);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Variable& row = rows[i];
    if (has_start(row)) continue;
    const std::string index = attribute("index", static_cast<double>(i + 1));
    initial += "      <Unknown" + index + initial_dependencies(rows, actors, row) + "/>\n";
    if (row.causality == Causality::state) continue;
    std::vector<bool> known(rows.size());
    actors.mark(row.depends_on, known);
    (row.causality == Causality::output ? outputs : derivatives) +=
        "      <Unknown" + index + attribute("dependencies", indices(known)) + "/>\n";
  }
  return "  <ModelStructure>\n" + section("Outputs", outputs) + section("Derivatives", derivatives) +
         section("InitialUnknowns", initial) + "  </ModelStructure>\n";
}

}  // namespace

std::string model_description(const Blueprint& blueprint) {
  const Identity& identity = blueprint.identity;
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription" + attribute("fmiVersion", "2.0") +
         attribute("modelName", identity.name) + attribute("guid", blueprint.guid) +
         attribute("description", identity.description) + attribute("version", TCA_VERSION) +
         attribute("author", "The tca-cosim authors") +
         attribute("copyright", "Copyright (c) 2026 The tca-cosim authors") + attribute("license", "MIT") +
         attribute("generationTool", "tca-cosim " TCA_VERSION) + attribute("generationDateAndTime", TCA_GENERATED) +
         attribute("variableNamingConvention", "structured") + attribute("numberOfEventIndicators", 0.0) + ">\n" +
         interfaces(identity, blueprint.has_model_exchange) + unit_definitions(blueprint.rows) +
         type_definitions(blueprint.rows) + log_categories() + default_experiment(blueprint) +
         model_variables(blueprint) + model_structure(blueprint.rows) + "</fmiModelDescription>\n";
}

}  // namespace fmu
