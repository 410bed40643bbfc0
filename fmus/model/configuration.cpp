#include "model/configuration.hpp"

#include <algorithm>
#include <charconv>

#include "model/model.hpp"

namespace fmu {
namespace {

constexpr std::string_view kBlank = " \t\r";

/// The first word of the line, which is taken off it with the blanks around it.
std::string_view take_word(std::string_view& line) {
  const auto skip = [&] { line.remove_prefix(std::min(line.size(), line.find_first_not_of(kBlank))); };
  skip();
  const std::string_view word = line.substr(0, line.find_first_of(kBlank));
  line.remove_prefix(word.size());
  skip();
  return word;
}

[[noreturn]] void refuse(std::size_t number, const std::string& problem) {
  throw Error("configuration, line " + std::to_string(number) + ": " + problem);
}

std::size_t read_count(std::size_t number, std::string_view name, std::string_view word, std::size_t most) {
  std::size_t count = 0;
  const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), count);
  if (failure != std::errc() || end != word.data() + word.size() || count < 1 || count > most)
    refuse(number, std::string(name) + " = '" + std::string(word) + "'; allowed: 1 to " + std::to_string(most));
  return count;
}

void read_line(std::size_t number, std::string_view line, Configuration& configuration) {
  const std::string_view name = take_word(line);
  if (name.empty()) return;
  std::string_view value = take_word(line);
  if (name == "tcas") {
    configuration.tcas = read_count(number, name, value, core::kMaxTcas);
  } else if (name == "segments") {
    configuration.segments = read_count(number, name, value, core::kMaxSegments);
  } else if (name == "ports") {
    if (value != "true" && value != "false")
      refuse(number, "ports = '" + std::string(value) + "'; allowed: true, false");
    configuration.has_ports = value == "true";
  } else if (name == "creep") {
    if (value != "true" && value != "false")
      refuse(number, "creep = '" + std::string(value) + "'; allowed: true, false");
    configuration.has_creep = value == "true";
  } else if (name == "states") {
    if (value != "all" && value != "moving")
      refuse(number, "states = '" + std::string(value) + "'; allowed: all, moving");
    configuration.has_moving_states_only = value == "moving";
  } else if (name == "start") {
    const std::string_view start = take_word(line);
    if (start.empty()) refuse(number, "start needs the name of a variable and a value");
    configuration.starts.push_back({std::string(value), std::string(start)});
  } else {
    refuse(number, "unknown entry '" + std::string(name) + "'; allowed: tcas, segments, ports, creep, states, start");
  }
  if (!line.empty()) refuse(number, "'" + std::string(line) + "' is too much; one entry per line");
}

}  // namespace

Configuration read_configuration(std::string_view text) {
  Configuration configuration;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    read_line(number, line, configuration);
  }
  return configuration;
}

std::string text_of(const Configuration& configuration) {
  std::string text = "tcas " + std::to_string(configuration.tcas) + "\nsegments " +
                     std::to_string(configuration.segments) + "\nstates " +
                     (configuration.has_moving_states_only ? "moving" : "all") + "\n";
  if (configuration.has_ports) text += "ports true\n";
  if (configuration.has_creep) text += "creep true\n";
  for (const Start& start : configuration.starts) text += "start " + start.name + " " + start.value + "\n";
  return text;
}

}  // namespace fmu
