// Every output is written by every method, closure and kind of body, moving or not.
#include <gtest/gtest.h>

#include "unwritten_outputs.hpp"

namespace rod {
namespace {

using Values = std::map<std::string, double>;

constexpr double kStep = 1e-3;    // s
constexpr double kPadeEuler = 5;  // item of the enumeration `method`
const Values kLoads{{"T[1]", 310.0}, {"gravity[3]", -9.81}};

/// The number of items of an enumeration.
std::size_t items(const std::string& name) {
  for (const fmu::Variable& row : fmu::variables({}))
    if (row.name == name) return row.items.size();
  throw fmu::Error("no variable " + name);
}

/// A kind of body: its sizes, and the parameters that make it what it is.
struct Body {
  const char* name;
  fmu::Configuration configuration;
  Values parameters;
  bool is_for_grid = false;  // offered by pade_euler
};

std::vector<Body> bodies() {
  fmu::Configuration segmented, with_ports, many;
  segmented.segments = 3;
  with_ports.has_ports = true;
  many.tcas = 5;
  return {{"uniform", {}, {}, true},
          {"five TCAs", many, {}, true},
          {"three segments, one tapered", segmented, {{"segment.radius[3,2]", 4e-3}, {"tca.last_segment[2]", 2}}},
          {"tip body", {}, {{"tip_body.mass", 2e-3}}},
          {"ports", with_ports, {{"shape.f[5,1]", 0.01}}},
          {"bonded", {}, {{"tca.contact", 2}}},
          {"tethered", {}, {{"tca.ends", 2}}}};
}

/// Every combination of method, closure, dynamic and planar with this body.
void expect_all_written(const Body& body) {
  for (std::size_t method = 1; method <= items("method"); ++method)
    for (std::size_t closure = 1; closure <= items("closure"); ++closure)
      for (const bool dynamic : {false, true})
        for (const bool planar : {false, true}) {
          const bool is_grid = dynamic && method == kPadeEuler;
          const bool is_held = body.parameters.contains("tca.contact") || body.parameters.contains("tca.ends");
          const bool is_asymmetric = body.parameters.contains("tca.last_segment[2]");
          if (is_grid && (planar || !body.is_for_grid)) continue;
          if (is_held && closure != 1) continue;
          if (planar && is_asymmetric) continue;
          Values values = body.parameters;
          values.insert(kLoads.begin(), kLoads.end());
          values.insert({{"method", method}, {"closure", closure}, {"dynamic", dynamic}, {"planar", planar}});
          EXPECT_EQ(fmu::unwritten_outputs(body.configuration, values, kStep), std::vector<std::string>{})
              << body.name << ", method " << method << ", closure " << closure << ", dynamic " << dynamic << ", planar "
              << planar;
        }
}

TEST(Outputs, AreWrittenByEveryMethodForEveryBody) {
  ASSERT_EQ(items("method"), 6u);
  ASSERT_EQ(items("closure"), 2u);
  for (const Body& body : bodies()) expect_all_written(body);
}

TEST(Outputs, AreWrittenForEveryChoiceOfStrains) {
  for (std::size_t strains = 1; strains <= items("strains"); ++strains) {
    Values values = kLoads;
    values["strains"] = static_cast<double>(strains);
    EXPECT_EQ(fmu::unwritten_outputs({}, values, kStep), std::vector<std::string>{}) << "strains " << strains;
  }
}

}  // namespace
}  // namespace rod
