// The variable table of thermal.fmu: one row per variable.
#include "model/table.hpp"

#include <memory>
#include <string>
#include <vector>

#include "fmu/data.hpp"
#include "fmu/thermal_model.hpp"

namespace fmu {
namespace {

constexpr double kTiny = 1e-9;  // least value of what must be positive
constexpr double kHuge = 1e12;

using thermal::Data;

/// A parameter that every TCA gets. A row that is declared later overrides what an earlier one set, so all rows of this
/// kind come before those of single TCAs.
template <class Refine>
void for_all_tcas(Table<Data>& table, const thermal::Tca& tca, const char* name, const thermal::PerTca& values,
                  const char* unit, const char* description, Refine&& refine) {
  Variable& row = table.parameter(name, values[0], unit, description);
  refine(row);
  for (std::size_t i = 1; i < tca.count; ++i) table.also(row, values[i]);
}

/// A parameter of each TCA.
template <class Refine>
void per_tca(Table<Data>& table, const thermal::Tca& tca, const char* name, const thermal::PerTca& values,
             const char* unit, const char* description, Refine&& refine) {
  for (std::size_t i = 0; i < tca.count; ++i) refine(table.parameter(indexed(name, i), values[i], unit, description));
}

void geometry_and_material(Table<Data>& table, const thermal::Parameters& p) {
  table.parameter("body.radius", p.body.radius, "m", "Outer radius of the body").range(kTiny, 1e3).nominal(5e-3);
  table.parameter("body.length", p.body.length, "m", "Length of body and TCAs").range(kTiny, 1e3).nominal(0.04);
  table.parameter("body.k", p.body.k, "W/(m.K)", "Heat conductivity of the body").range(kTiny, 1e6);
  table.parameter("body.rho_c", p.body.rho_c, "J/(m3.K)", "Heat capacity of the body").range(1.0, kHuge).nominal(1e6);
}

/// The parameters of TCAs in the order of the table: declare(name, values, unit, description, refine) for each. Those
/// that are usually the same for all TCAs come in both forms, for all and one by one.
template <class Declare>
void shared_by_tcas(const thermal::Tca& tca, Declare&& declare) {
  const auto length = [](Variable& row) { row.range(kTiny, 1e3).nominal(1e-3); };
  declare("tca.outer_radius", tca.outer_radius, "m", "Outer radius of the TCA", length);
  declare("tca.inner_radius", tca.inner_radius, "m", "Radius of the TCA's insulated bore", length);
  declare("tca.offset", tca.offset, "m", "Distance of the TCA's axis from the body's axis",
          [](Variable& row) { row.range(0.0, 1e3).nominal(1e-3); });
  declare("tca.k", tca.k, "W/(m.K)", "Heat conductivity of the TCA", [](Variable& row) { row.range(kTiny, 1e6); });
  declare("tca.rho_c", tca.rho_c, "J/(m3.K)", "Heat capacity of the TCA",
          [](Variable& row) { row.range(1.0, kHuge).nominal(1e6); });
}
template <class Declare>
void circuit_of_tcas(const thermal::Tca& tca, Declare&& declare) {
  declare("tca.alpha_T", tca.alpha_T, "1/K",
          "Relative change of resistance with temperature, R (1 + alpha_T (T - T_ref) + beta delta/length)",
          [](Variable& row) { row.range(-1.0, 1.0).nominal(1e-3); });
  declare("tca.beta", tca.beta, "1", "Relative change of resistance with the strain delta/length",
          [](Variable& row) { row.range(-1e3, 1e3); });
}

void tcas(Table<Data>& table, const thermal::Parameters& p) {
  const auto all = [&](auto&&... parts) { for_all_tcas(table, p.tca, parts...); };
  const auto each = [&](const char* name, const thermal::PerTca& values, const char* unit, const char* description,
                        auto&& refine) { per_tca(table, p.tca, name, values, unit, description, refine); };
  shared_by_tcas(p.tca, all);
  circuit_of_tcas(p.tca, all);
  shared_by_tcas(p.tca, each);
  per_tca(table, p.tca, "tca.azimuth", p.tca.azimuth, "rad", "Angle of the TCA's axis about the body's axis",
          [](Variable& row) { row.range(-1e3, 1e3); });
  per_tca(table, p.tca, "tca.R", p.tca.R, "ohm", "Resistance of the TCA at tca.T_ref and delta = 0",
          [](Variable& row) { row.range(kTiny, kHuge).nominal(10.0).retuned(); });
  circuit_of_tcas(p.tca, [&](const char* name, const thermal::PerTca& values, const char* unit, const char* description,
                             auto&& refine) {
    per_tca(table, p.tca, name, values, unit, description, [&](Variable& row) { refine(row), row.retuned(); });
  });
}

void surroundings(Table<Data>& table, const thermal::Parameters& p) {
  table.parameter("tca.T_ref", p.tca.T_ref, "K", "Temperature at which tca.R holds")
      .range(1.0, 1e4)
      .nominal(300.0)
      .retuned();
  table
      .parameter(
          "convection", p.convection, "",
          "Heat transfer at the surface: constant, the parameter h; free, of a horizontal cylinder in still air; "
          "forced, in air of the speed air_speed across it. The last two need level = full or lumped")
      .choices({"constant", "free", "forced"});
  table.parameter("h", p.h, "W/(m2.K)", "Heat transfer coefficient at the body's surface where convection = constant")
      .range(kTiny, 1e9)
      .nominal(20.0);
  table.parameter("T_0", p.T_0, "K", "Temperature of the whole section at the start").range(1.0, 1e4).nominal(300.0);
  table
      .parameter("level", p.level, "", "Model: resistor network, reduced with known error, or all unknowns of the mesh")
      .choices({"lumped", "reduced", "full"});
  table
      .parameter("tolerance", p.tolerance, "1",
                 "Relative error of temperature rises: chooses mesh, number of states and the steps inside `full`; a "
                 "change after initialisation reaches the steps only")
      .range(1e-8, 0.1)
      .nominal(1e-5)
      .tunable();
}

void inputs(Table<Data>& table, const Data& data) {
  for (std::size_t i = 0; i < data.parameters.tca.count; ++i) {
    table.input(indexed("V", i), data.V[i], "V", "Voltage across the TCA");
  }
  for (std::size_t i = 0; i < data.parameters.tca.count; ++i) {
    table.input(indexed("delta", i), data.delta[i], "m", "Displacement of the TCA, acts through tca.beta")
        .nominal(1e-3);
  }
  table.input("T_ambient", data.T_ambient, "K", "Temperature of the surroundings").range(1.0, 1e4).nominal(300.0);
  table
      .input("air_speed", data.air_speed, "m/s",
             "Speed of the air across the body in either sense, acts where convection = forced")
      .range(-100.0, 100.0);
}

void outputs(Table<Data>& table, const Data& data) {
  for (std::size_t i = 0; i < data.parameters.tca.count; ++i) {
    table.output(indexed("T", i), data.T[i], data.T_rate[i], "K", "Mean temperature of the TCA")
        .nominal(300.0)
        .depends({"mode"});
  }
  for (std::size_t i = 0; i < data.parameters.tca.count; ++i) {
    table.output(indexed("P", i), data.P[i], "W", "Electrical power into the TCA")
        .depends({indexed("V", i), indexed("delta", i), "mode"});
  }
  table.output("Q_loss", data.Q_loss, "W", "Heat flow from the surface to the surroundings")
      .depends({"T_ambient", "air_speed", "mode"});
  table.output("E_stored", data.E_stored, "J", "Heat stored since the uniform temperature T_0").depends({"mode"});
  table
      .output("T_max", data.T_max, "K",
              "Highest temperature in the TCAs and on the surface: the maximum of the field, not of its nodes")
      .nominal(300.0)
      .depends({"mode"})
      .on_demand();
  table.output("T_surface", data.T_surface, "K", "Mean temperature of the surface").nominal(300.0).depends({"mode"});
  table.output("h_surface", data.coefficient, "W/(m2.K)", "Heat transfer coefficient at the surface now")
      .nominal(10.0)
      .depends({"T_ambient", "air_speed", "mode"});
  table
      .output(
          "reduction.bound", data.reduction_bound, "K",
          "Bound of the error of every T[i] so far, against the same mesh unreduced; a warning says where it or the "
          "mesh misses `tolerance`")
      .difference();
  table.output("reduction.states", data.reduction_states, "1", "Number of states of the chosen level").nominal(10.0);
}

void states(Table<Data>& table, std::size_t tcas) {
  for (std::size_t k = 0; k < thermal::most_amplitudes(tcas); ++k) {
    table
        .state(indexed("mode", k), "K", "K/s",
               "Amplitude of a mode of the levels reduced and lumped; a uniform rise of 1 K has amplitudes whose "
               "squares sum to 1")
        .difference()
        .starts_from({})  // uniform at T_0 whatever the inputs
        .depends({"mode", "V", "delta", "T_ambient", "air_speed"});
  }
}

}  // namespace

Identity identity() {
  return {.name = "thermal",
          .description = "Heat in the cross-section of a soft manipulator with electrically heated actuators (TCAs)",
          .stop_time = 30.0,
          .step_size = 0.1};
}

std::vector<Variable> variables(const Configuration& configuration) {
  const Data defaults(configuration.tcas);
  Table<Data> table(defaults);
  geometry_and_material(table, defaults.parameters);
  tcas(table, defaults.parameters);
  surroundings(table, defaults.parameters);
  inputs(table, defaults);
  outputs(table, defaults);
  states(table, configuration.tcas);
  return std::move(table).rows();
}

std::unique_ptr<Model> make_model(const Configuration& configuration) {
  return std::make_unique<thermal::ThermalModel>(configuration.tcas);
}

}  // namespace fmu
