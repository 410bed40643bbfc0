// The configuration that lies in the resources folder of an unpacked FMU.
#pragma once

#include <string>
#include <string_view>

#include "model/configuration.hpp"

namespace fmu {

inline constexpr std::string_view kConfigurationFile = "configuration.txt";

/// The folder of fmi2Instantiate's fmuResourceLocation, a URI such as file:///tmp/rod/resources (FMI 2.0.4, section
/// 2.1.5; RFC 8089), in UTF-8; a plain path is taken as it is. Throws Error for other schemes.
std::string folder_of(std::string_view uri);

/// Reads configuration.txt in that folder. Throws Error naming the file when it is not there or not a configuration.
Configuration read_configuration_file(std::string_view uri);

}  // namespace fmu
