#include "description/documentation.hpp"

#include <algorithm>
#include <cmath>

#include "model/text.hpp"

namespace fmu {
namespace {

constexpr std::string_view kStyle =
    "body{font:16px/1.45 sans-serif;max-width:75em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;font-size:14px}th,td{border:1px solid #ccc;padding:.2em .5em;text-align:left;"
    "vertical-align:top}th{background:#eee}code{background:#f4f4f4}";

std::string element(std::string_view tag, std::string_view content) {
  const std::string name(tag);
  return "<" + name + ">" + std::string(content) + "</" + name + ">";
}

/// A line of the notes: `code` becomes an element, the rest is text.
std::string inline_text(std::string_view line) {
  std::string result;
  for (bool code = false; !line.empty(); code = !code) {
    const std::string_view piece = line.substr(0, line.find('`'));
    result += code ? element("code", escaped(piece)) : escaped(piece);
    line.remove_prefix(std::min(line.size(), piece.size() + 1));
  }
  return result;
}

std::string notes_section(std::string_view notes) {
  std::string result;
  bool in_list = false;
  while (!notes.empty()) {
    const std::string_view line = notes.substr(0, notes.find('\n'));
    notes.remove_prefix(std::min(notes.size(), line.size() + 1));
    const bool item = line.starts_with("- ");
    if (item != in_list && (item || !line.empty())) result += (in_list = item) ? "<ul>\n" : "</ul>\n";
    if (item)
      result += element("li", inline_text(line.substr(2))) + "\n";
    else if (line.starts_with("# "))
      result += element("h2", inline_text(line.substr(2))) + "\n";
    else if (!line.empty())
      result += element("p", inline_text(line)) + "\n";
  }
  return in_list ? result + "</ul>\n" : result;
}

std::string_view role(const Variable& row) {
  switch (row.causality) {
    case Causality::parameter:
      return row.is_tunable ? "parameter, tunable" : "parameter";
    case Causality::input:
      return "input";
    case Causality::output:
      return "output";
    case Causality::state:
      return "state";
    case Causality::derivative:
      return "derivative";
  }
  return {};
}

std::string start(const Variable& row) {
  if (!has_start(row)) return {};
  if (row.type == Type::boolean) return row.start != 0.0 ? "true" : "false";
  if (row.type == Type::enumeration) return row.items.at(static_cast<std::size_t>(row.start) - 1);
  return text(row.start);
}

std::string range(const Variable& row) {
  if (row.type == Type::boolean) return "false, true";
  std::string result;
  for (std::size_t i = 0; i < row.items.size(); ++i) append(result, std::to_string(i + 1) + " " + row.items[i]);
  if (!row.items.empty()) return result;
  if (std::isfinite(row.least)) result = "from " + text(row.least);
  if (std::isfinite(row.most)) append(result, "to " + text(row.most), " ");
  return result;
}

std::string table(const std::vector<Variable>& rows) {
  std::string result = "<table id=\"variables\">\n<thead><tr>";
  for (const char* title : {"name", "causality", "unit", "start", "range or choices", "description"})
    result += element("th", title);
  result += "</tr></thead>\n<tbody>\n";
  for (const Variable& row : rows)
    result += "<tr>" + element("td", element("code", escaped(row.name))) + element("td", role(row)) +
              element("td", escaped(row.unit)) + element("td", start(row)) + element("td", escaped(range(row))) +
              element("td", escaped(row.description)) + "</tr>\n";
  return result + "</tbody>\n</table>\n";
}

}  // namespace

std::string documentation(const Blueprint& blueprint, std::string_view notes) {
  const Identity& identity = blueprint.identity;
  const std::string title = escaped(identity.name + ".fmu: " + identity.description);
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"/>" + element("title", title) +
         element("style", kStyle) + "</head>\n<body>\n" + element("h1", title) + "\n" +
         element("p", "Version " TCA_VERSION ". FMI 2.0, co-simulation and model exchange. Default experiment: 0 to " +
                          text(identity.stop_time) + " s in steps of " + text(identity.step_size) +
                          " s. Licences: folder licenses.") +
         "\n" + notes_section(notes) + element("h2", "Variables") + "\n" +
         element("p", "SI units; temperatures are in kelvin. Numbers in square brackets count from 1.") + "\n" +
         table(blueprint.rows) + "</body>\n</html>\n";
}

}  // namespace fmu
