// modelDescription.xml of FMI 2.0, written from the variable table.
#pragma once

#include <string>

#include "description/blueprint.hpp"

namespace fmu {

/// The whole file. Throws Error naming the variable when a unit cannot be read.
std::string model_description(const Blueprint& blueprint);

}  // namespace fmu
