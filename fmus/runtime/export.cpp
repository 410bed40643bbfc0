// tcaExport: the files of this FMU at another configuration, for whoever packs FMUs around this binary.
#include <exception>
#include <string>

#include "description/description.hpp"
#include "description/documentation.hpp"
#include "fmi2Functions.h"
#include "runtime/resources.hpp"

extern "C" {

/// Receives the path of a file inside the FMU and its content; or "error" and the reason.
using tcaReceiveFile = void (*)(void* context, const char* path, const char* content);

/// Hands over modelDescription.xml, documentation/index.html and resources/configuration.txt for a configuration
/// (model/configuration.hpp; null or empty: the default). notes: of the documentation, may be null. Returns 0, or 1
/// after an error. The texts are valid during the call alone.
FMI2_Export int tcaExport(const char* configuration, const char* notes, tcaReceiveFile receive, void* context) {
  if (!receive) return 1;
  try {
    const auto blueprint = fmu::Blueprint::of(fmu::read_configuration(configuration ? configuration : ""));
    receive(context, "modelDescription.xml", fmu::model_description(*blueprint).c_str());
    receive(context, "documentation/index.html", fmu::documentation(*blueprint, notes ? notes : "").c_str());
    const std::string path = "resources/" + std::string(fmu::kConfigurationFile);
    receive(context, path.c_str(), fmu::text_of(blueprint->configuration).c_str());
    return 0;
  } catch (const std::exception& error) {
    receive(context, "error", error.what());
  } catch (...) {
    receive(context, "error", "unknown failure");
  }
  return 1;
}

}  // extern "C"
