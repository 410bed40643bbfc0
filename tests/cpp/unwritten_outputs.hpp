// Which outputs a model leaves unwritten: those of the table that a method or level forgets.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/unwritten.hpp"
#include "description/blueprint.hpp"

namespace fmu {

/// Names of the outputs and rates that are not written after initialisation, or not after a step of h [s], with the
/// parameters and inputs of these values. A model that cannot be built or stepped throws Error.
inline std::vector<std::string> unwritten_outputs(const Configuration& configuration,
                                                  const std::map<std::string, double>& values, double h) {
  const std::vector<Variable> rows = variables(configuration);
  const auto model = make_model(configuration);
  std::byte* data = model->data().data();
  write_starts(rows, data);
  std::size_t used = 0;
  for (const Variable& row : rows)
    if (const auto value = values.find(row.name); value != values.end()) set_value(row, data, value->second), ++used;
  if (used != values.size()) throw Error("a value has a name that the table does not have");
  require(model->build());
  require(model->initialise(0.0));
  std::vector<std::string> names;
  const auto evaluate = [&](double t, const char* when) {
    mark_outputs_unwritten(rows, data);
    require(model->evaluate(t));
    require(model->evaluate_on_demand(t, ~0u));
    for (const Variable& row : rows) {
      if (row.causality != Causality::output || row.type != Type::real) continue;
      if (core::is_unwritten(load<double>(data, row.offset))) names.push_back(row.name + when);
      if (row.derivative >= 0 && core::is_unwritten(load<double>(data, row.derivative)))
        names.push_back("rate of " + row.name + when);
    }
  };
  evaluate(0.0, " at the start");
  require(model->step(0.0, h).status);
  evaluate(h, " after a step");
  return names;
}

}  // namespace fmu
