// Rows of the variable table of rod.fmu, by kind.
#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/table.hpp"
#include "physics/data.hpp"

namespace rod {

using Table = fmu::Table<Data>;
class SharedRows;

constexpr double kTiny = 1e-12;  // least value of a quantity that must be positive, in its SI unit
constexpr double kHuge = 1e30;
constexpr double kFullTurn = 6.283185307179586;
constexpr const char* kAxes[3] = {"x", "y", "z"};

/// "name[2,1]": the structured name of an element of a matrix, indices from 0.
inline std::string element(const std::string& name, std::size_t row, std::size_t column) {
  return name + "[" + std::to_string(row + 1) + "," + std::to_string(column + 1) + "]";
}

void add_parameters(Table& table, const Parameters& p, bool has_creep);
void add_body(Table& table, SharedRows& shared, const Parameters& p);
/// Rows of single segments whose names have two indices, or whose row for all segments is special.
void add_segments(Table& table, const Parameters& p);
void add_tip_body(Table& table, const Parameters& p);
void add_tcas(Table& table, SharedRows& shared, const Parameters& p, bool has_creep);
/// Rows of single TCAs that have no row for all, or a special one.
void add_routing(Table& table, const Parameters& p);
/// Marks the parameters that may change in a rod that moves.
void mark_retuned(std::vector<fmu::Variable>& rows);

void add_inputs(Table& table, const Inputs& u);
void add_outputs(Table& table, const Outputs& y, std::size_t tcas);
/// Ports for models of the surroundings: forces along the body, velocities where they act, reaction of the clamp.
void add_ports(Table& table, const Inputs& u, const Outputs& y);
/// Creep of the TCAs, of an FMU that is written with it.
void add_creep(Table& table, const Outputs& y, std::size_t tcas);
/// Coefficients of the largest rod and their rates, in the order of Rod::to_states.
void add_states(Table& table, std::size_t segments, bool has_ports);

}  // namespace rod
