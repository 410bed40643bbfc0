#include "description/units.hpp"

#include <cctype>
#include <utility>

#include "model/model.hpp"

namespace fmu {
namespace {

struct Symbol {
  std::string_view name;
  BaseUnit exponents;
};
constexpr std::array<Symbol, 16> kSymbols{{
    // clang-format off
    //        kg  m   s   A  K mol cd rad
    {"1",   { 0,  0,  0,  0, 0, 0, 0, 0}},
    {"kg",  { 1,  0,  0,  0, 0, 0, 0, 0}},
    {"m",   { 0,  1,  0,  0, 0, 0, 0, 0}},
    {"s",   { 0,  0,  1,  0, 0, 0, 0, 0}},
    {"A",   { 0,  0,  0,  1, 0, 0, 0, 0}},
    {"K",   { 0,  0,  0,  0, 1, 0, 0, 0}},
    {"mol", { 0,  0,  0,  0, 0, 1, 0, 0}},
    {"cd",  { 0,  0,  0,  0, 0, 0, 1, 0}},
    {"rad", { 0,  0,  0,  0, 0, 0, 0, 1}},
    {"Hz",  { 0,  0, -1,  0, 0, 0, 0, 0}},
    {"N",   { 1,  1, -2,  0, 0, 0, 0, 0}},
    {"Pa",  { 1, -1, -2,  0, 0, 0, 0, 0}},
    {"J",   { 1,  2, -2,  0, 0, 0, 0, 0}},
    {"W",   { 1,  2, -3,  0, 0, 0, 0, 0}},
    {"V",   { 1,  2, -3, -1, 0, 0, 0, 0}},
    {"ohm", { 1,  2, -3, -2, 0, 0, 0, 0}},
    // clang-format on
}};

[[noreturn]] void refuse(std::string_view unit, std::string_view part) {
  std::string known;
  for (const Symbol& symbol : kSymbols) (known += known.empty() ? "" : ", ") += symbol.name;
  throw Error("unit '" + std::string(unit) + "': cannot read '" + std::string(part) +
              "'; write products and one quotient such as W/(m2.K) of " + known);
}

/// Adds sign * exponents of a product such as "m2.K".
void add_product(std::string_view unit, std::string_view product, int sign, BaseUnit& total) {
  while (true) {
    const std::size_t dot = product.find('.');
    const std::string_view power = product.substr(0, dot);
    std::string_view name = power;
    int exponent = 1;
    if (name.size() > 1 && std::isdigit(static_cast<unsigned char>(name.back()))) {
      exponent = name.back() - '0';
      name.remove_suffix(1);
    }
    bool is_known = false;
    for (const Symbol& symbol : kSymbols) {
      if (symbol.name != name) continue;
      for (std::size_t i = 0; i < total.size(); ++i) total[i] += sign * exponent * symbol.exponents[i];
      is_known = true;
    }
    if (!is_known) refuse(unit, power);
    if (dot == std::string_view::npos) return;
    product.remove_prefix(dot + 1);
  }
}

}  // namespace

BaseUnit base_unit(std::string_view unit) {
  BaseUnit total{};
  const std::size_t slash = unit.find('/');
  add_product(unit, unit.substr(0, slash), 1, total);
  if (slash == std::string_view::npos) return total;
  std::string_view below = unit.substr(slash + 1);
  if (below.starts_with('(') && below.ends_with(')')) {
    below.remove_prefix(1);
    below.remove_suffix(1);
  }
  add_product(unit, below, -1, total);
  return total;
}

}  // namespace fmu
