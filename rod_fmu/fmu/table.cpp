// The variable table of rod.fmu: one row per variable.
#include "model/table.hpp"

#include <memory>
#include <utility>
#include <vector>

#include "fmu/rod_model.hpp"
#include "fmu/rows.hpp"
#include "model/model.hpp"

fmu::Identity fmu::identity() {
  return {.name = "rod", .description = "Dynamic Cosserat rod driven by twisted-and-coiled actuators"};
}

std::vector<fmu::Variable> fmu::variables(const fmu::Configuration& configuration) {
  const rod::Data defaults(configuration.tcas, configuration.segments, configuration.has_ports);
  const rod::Parameters& p = defaults.parameters;
  rod::Table table(defaults);
  rod::add_parameters(table, p, configuration.has_creep);
  rod::add_inputs(table, defaults.inputs);
  rod::add_outputs(table, defaults.outputs, p.tcas);
  if (configuration.has_ports) rod::add_ports(table, defaults.inputs, defaults.outputs);
  if (configuration.has_creep) rod::add_creep(table, defaults.outputs, p.tcas);
  rod::add_states(table, p.segments, configuration.has_ports);
  std::vector<Variable> rows = std::move(table).rows();
  rod::mark_retuned(rows);
  return rows;
}

std::unique_ptr<fmu::Model> fmu::make_model(const fmu::Configuration& configuration) {
  return std::make_unique<rod::RodModel>(configuration.tcas, configuration.segments, configuration.has_ports);
}
