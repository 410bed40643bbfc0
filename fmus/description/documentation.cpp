#include "description/documentation.hpp"

#include <algorithm>
#include <cmath>

#include "model/text.hpp"

namespace fmu {
namespace {

constexpr std::string_view kStyle =
    "body{font:16px/1.45 sans-serif;max-width:75em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;font-size:14px;display:block;overflow-x:auto}th,td{border:1px solid "
    "#ccc;padding:.2em .5em;text-align:left;"
    "vertical-align:top}th{background:#eee}code,pre{background:#f4f4f4}pre{padding:.5em;overflow:auto}svg{max-width:"
    "100%}";

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

/// A row of a table, "| a | b |".
std::string table_row(std::string_view line, std::string_view cell) {
  std::string result;
  line.remove_prefix(1);
  while (line.find('|') != std::string_view::npos) {
    std::string_view text = line.substr(0, line.find('|'));
    line.remove_prefix(text.size() + 1);
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ')) text.remove_suffix(1);
    result += element(cell, inline_text(text));
  }
  return element("tr", result) + "\n";
}

enum class Block { none, list, table, code };

constexpr std::string_view kOpen[] = {"", "<ul>\n", "<table>\n", "<pre>"},
                           kClose[] = {"", "</ul>\n", "</table>\n", "</pre>\n"};

std::string notes_section(std::string_view notes) {
  std::string result;
  Block block = Block::none;
  const auto enter = [&](Block next) {
    if (next == block) return false;
    result += std::string(kClose[static_cast<int>(block)]) + std::string(kOpen[static_cast<int>(next)]);
    block = next;
    return true;
  };
  while (!notes.empty()) {
    const std::string_view line = notes.substr(0, notes.find('\n'));
    notes.remove_prefix(std::min(notes.size(), line.size() + 1));
    if (line.starts_with("```")) {
      enter(block == Block::code ? Block::none : Block::code);
    } else if (block == Block::code) {
      result += escaped(line) + "\n";
    } else if (line.starts_with("- ")) {
      enter(Block::list);
      result += element("li", inline_text(line.substr(2))) + "\n";
    } else if (line.starts_with("| ")) {
      const bool is_first = enter(Block::table);
      result += table_row(line, is_first ? "th" : "td");
    } else {
      enter(Block::none);
      if (line.empty()) continue;
      if (line.starts_with("<svg"))
        result += std::string(line) + "\n";
      else if (line.starts_with("# "))
        result += element("h2", inline_text(line.substr(2))) + "\n";
      else
        result += element("p", inline_text(line)) + "\n";
    }
  }
  enter(Block::none);
  return result;
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
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"/><meta name=\"viewport\" "
         "content=\"width=device-width\"/>" +
         element("title", title) + element("style", kStyle) + "</head>\n<body>\n" + element("h1", title) + "\n" +
         element("p", "Version " TCA_VERSION ". FMI 2.0, co-simulation and model exchange. Default experiment: 0 to " +
                          text(identity.stop_time) + " s in steps of " + text(identity.step_size) +
                          " s. Licences: folder licenses.") +
         "\n" + notes_section(notes) + element("h2", "Variables") + "\n" +
         element("p", "SI units; temperatures are in kelvin. Numbers in square brackets count from 1.") + "\n" +
         table(blueprint.rows) + "</body>\n</html>\n";
}

}  // namespace fmu
