// What an FMU is written with: size of the body, states that it declares, start values. Its text is the file
// resources/configuration.txt of the FMU, one entry per line, in any order; what is not named has its default:
//   tcas 4                   number of TCAs, 1 to 12
//   segments 2               number of segments of the rod, 1 to 6; the thermal FMU is one cross-section and ignores it
//   ports true               false (default), or ports of the rod for contact, fluid and multibody models
//   creep true               false (default), or creep of TCAs whose law is measured: its parameters and outputs
//   states moving            all (default), or those alone that the start values of the parameters let move
//   start body.radius 0.004  start value of a parameter or input: a number, true or false, or an enumeration's item
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/capacity.hpp"

namespace fmu {

struct Start {
  std::string name;
  std::string value;
  bool operator==(const Start&) const = default;
};

struct Configuration {
  std::size_t tcas = core::kDefaultTcas;
  std::size_t segments = core::kDefaultSegments;
  bool has_ports = false;
  bool has_creep = false;
  bool has_moving_states_only = false;
  std::vector<Start> starts;
  bool operator==(const Configuration&) const = default;
};

/// Throws Error with the line, what is wrong and what is allowed.
Configuration read_configuration(std::string_view text);

/// The text that read_configuration() reads as this configuration.
std::string text_of(const Configuration& configuration);

}  // namespace fmu
