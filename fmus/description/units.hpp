// What a unit such as "W/(m2.K)" is in SI base units, read from its spelling, and how people like to see it.
#pragma once

#include <array>
#include <string>
#include <string_view>

namespace fmu {

/// Exponents of kg, m, s, A, K, mol, cd, rad, in the order of FMI's BaseUnit. All units of the tables are coherent:
/// factor 1.
using BaseUnit = std::array<int, 8>;
inline constexpr std::array<std::string_view, 8> kBaseUnits{"kg", "m", "s", "A", "K", "mol", "cd", "rad"};

/// Products "N.m", powers "m2", one quotient "W/(m2.K)" of base units and of N, Pa, J, W, V, ohm, Hz; "1" for none.
/// Throws Error naming the unit when it cannot be read.
BaseUnit base_unit(std::string_view unit);

/// displayed = factor * value + offset
struct DisplayUnit {
  std::string_view unit;
  std::string_view name;
  double factor;
  double offset;
};
inline constexpr std::array<DisplayUnit, 3> kDisplayUnits{{
    {"K", "degC", 1.0, -273.15},
    {"m", "mm", 1e3, 0.0},
    {"rad", "deg", 57.295779513082323, 0.0},
}};

}  // namespace fmu
