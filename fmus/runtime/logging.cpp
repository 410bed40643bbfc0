#include "runtime/logging.hpp"

#include "model/model.hpp"
#include "model/text.hpp"

namespace fmu {

Log::Log(std::string instance, const fmi2CallbackFunctions* functions, bool debug) : instance_(std::move(instance)) {
  if (functions) {
    logger_ = functions->logger;
    environment_ = functions->componentEnvironment;
  }
  on_.fill(debug);
}

void Log::write(std::size_t category, std::string_view message) const noexcept try {
  if (!is_on(category)) return;
  // The message is a printf format to the host, and '#' opens a value reference in it: both are doubled to stand for
  // themselves. Passing "%s" instead would lose the text in hosts whose callback cannot take variadic arguments.
  std::string format;
  for (const char c : message) {
    if (c == '%' || c == '#') format += c;
    format += c;
  }
  const Category& kind = category::kAll[category];
  logger_(environment_, instance_.c_str(), kind.status, kind.name, format.c_str());
} catch (...) {
}

void Log::enable(bool on, std::span<const fmi2String> names) {
  auto changed = on_;
  if (names.empty()) changed.fill(on);
  for (const fmi2String name : names) {
    const std::string_view wanted = name ? name : "";
    bool known = wanted == category::kEverything;
    if (known) changed.fill(on);
    for (std::size_t i = 0; i < on_.size(); ++i) {
      if (wanted != category::kAll[i].name) continue;
      changed[i] = on;
      known = true;
    }
    if (known) continue;
    std::string list = category::kEverything;
    for (const Category& kind : category::kAll) append(list, kind.name);
    throw Error("unknown log category '" + std::string(wanted) + "'; there are " + list);
  }
  on_ = changed;
}

}  // namespace fmu
