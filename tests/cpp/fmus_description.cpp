// Units from their spelling, and modelDescription.xml. That it satisfies the standard is tested with FMPy in Python.
#include <gtest/gtest.h>

#include "description/description.hpp"
#include "description/units.hpp"

namespace fmu {
namespace {

TEST(Units, AreReadFromTheirSpelling) {
  //                                         kg  m   s   A   K  mol cd rad
  EXPECT_EQ(base_unit("1"), (BaseUnit{0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(base_unit("K"), (BaseUnit{0, 0, 0, 0, 1, 0, 0, 0}));
  EXPECT_EQ(base_unit("1/K"), (BaseUnit{0, 0, 0, 0, -1, 0, 0, 0}));
  EXPECT_EQ(base_unit("m/s2"), (BaseUnit{0, 1, -2, 0, 0, 0, 0, 0}));
  EXPECT_EQ(base_unit("N.m"), (BaseUnit{1, 2, -2, 0, 0, 0, 0, 0}));
  EXPECT_EQ(base_unit("W/(m.K)"), (BaseUnit{1, 1, -3, 0, -1, 0, 0, 0}));
  EXPECT_EQ(base_unit("W/(m2.K)"), (BaseUnit{1, 0, -3, 0, -1, 0, 0, 0}));
  EXPECT_EQ(base_unit("J/(m3.K)"), (BaseUnit{1, -1, -2, 0, -1, 0, 0, 0}));
  EXPECT_EQ(base_unit("ohm"), (BaseUnit{1, 2, -3, -2, 0, 0, 0, 0}));
  EXPECT_EQ(base_unit("rad/m"), (BaseUnit{0, -1, 0, 0, 0, 0, 0, 1}));
}

TEST(Units, ThatCannotBeReadAreNamed) {
  for (const char* bad : {"", "furlong", "m/", "m.", "m/(s", "m/s/s", "m22"}) {
    try {
      base_unit(bad);
      FAIL() << bad;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("unit '" + std::string(bad) + "'"), std::string::npos);
    }
  }
}

TEST(Table, RefusesContradictions) {
  const auto complaint = [](auto&& spoil) -> std::string {
    auto rows = Blueprint::get().rows;
    spoil(rows);
    try {
      check_table(rows);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  using Rows = std::vector<Variable>;
  EXPECT_EQ(complaint([](Rows&) {}), "");
  EXPECT_NE(complaint([](Rows& rows) { rows[1].name = rows[0].name; }).find("twice"), std::string::npos);
  EXPECT_NE(complaint([](Rows& rows) { rows[0].start = 99.0; }).find("range"), std::string::npos);
  EXPECT_NE(complaint([](Rows& rows) { rows[0].unit = ""; }).find("unit"), std::string::npos);
  EXPECT_NE(complaint([](Rows& rows) { rows.back().depends_on = {"mass"}; }).find("neither an input"),
            std::string::npos);
  EXPECT_NE(complaint([](Rows& rows) { rows.back().rate_unit = "1/s"; }).find("state"), std::string::npos);
  EXPECT_NE(complaint([](Rows& rows) { rows.back().tunable(); }).find("tunable"), std::string::npos);
  EXPECT_NE(complaint([](Rows& rows) { rows[0].choices({"a"}); }).find("choices"), std::string::npos);
}

class Description : public testing::Test {
 protected:
  bool has(const std::string& text) const { return xml.find(text) != std::string::npos; }
  const Blueprint& blueprint = Blueprint::get();
  std::string xml = model_description(blueprint);
};

TEST_F(Description, EscapesWhatXmlReserves) {
  EXPECT_TRUE(has("description=\"Chain of masses &amp; springs, to try the &quot;runtime&quot; with\""));
  EXPECT_TRUE(has("description=\"Mass of each body, 0.1 &lt; m\""));
}

TEST_F(Description, SaysWhatARowSays) {
  EXPECT_TRUE(has("<Real unit=\"kg\" min=\"0.1\" max=\"10\" start=\"1\"/>"));
  EXPECT_TRUE(has("<Enumeration declaredType=\"scheme_choices\" min=\"1\" max=\"2\" start=\"2\"/>"));
  EXPECT_TRUE(has("<Item name=\"midpoint\" value=\"1\"/>"));
  EXPECT_TRUE(has("causality=\"parameter\" variability=\"tunable\" initial=\"exact\""));
  EXPECT_TRUE(has("<Boolean start=\"false\"/>"));
  EXPECT_TRUE(has("<Unit name=\"N.s/m\">\n      <BaseUnit kg=\"1\" s=\"-1\"/>"));
}

TEST_F(Description, DeclaresExactDependencies) {
  // Rows: 10 force, 11 bias, 12 x, 13 v, 14 reading, 15 builds, 16 to 25 position, 26 to 35 velocity, then derivatives.
  EXPECT_TRUE(has("<Unknown index=\"12\" dependencies=\"16 17 18 19 20 21 22 23 24 25\"/>"));
  EXPECT_TRUE(has("<Unknown index=\"14\" dependencies=\"11 16 17 18 19 20 21 22 23 24 25\"/>"));
  EXPECT_TRUE(has("<Unknown index=\"15\" dependencies=\"\"/>"));
  EXPECT_TRUE(has("<Unknown index=\"36\" dependencies=\"26\"/>"));
  // At the start, all parameters; position starts from the bias, velocity from nothing.
  EXPECT_TRUE(has("<Unknown index=\"14\" dependencies=\"1 2 3 4 5 6 7 8 9 11\"/>"));
  EXPECT_TRUE(has("<Unknown index=\"13\" dependencies=\"1 2 3 4 5 6 7 8 9\"/>"));
  EXPECT_TRUE(has("<Unknown index=\"46\" dependencies=\"1 2 3 4 5 6 7 8 9 10 11\"/>"));
}

TEST_F(Description, PairsStatesWithTheirDerivatives) {
  EXPECT_TRUE(has("name=\"der(velocity[1])\" valueReference=\"45\""));
  EXPECT_TRUE(has("<Real unit=\"m/s2\" derivative=\"26\"/>"));
  EXPECT_NE(xml.find("<Derivatives>\n      <Unknown index=\"36\""), std::string::npos);
  EXPECT_TRUE(has("<ModelExchange modelIdentifier=\"probe\""));
  EXPECT_TRUE(has("<CoSimulation modelIdentifier=\"probe\""));
}

TEST_F(Description, IsNamedByItsGuid) {
  EXPECT_TRUE(has("guid=\"" + blueprint.guid + "\""));
  EXPECT_EQ(blueprint.guid.size(), 38u);
}

}  // namespace
}  // namespace fmu
