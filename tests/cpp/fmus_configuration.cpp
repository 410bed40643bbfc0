// FMUs of another size: the configuration's text, the table and states that follow from it, and which binary takes it.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "description/description.hpp"
#include "probe/host.hpp"
#include "runtime/resources.hpp"

extern "C" int tcaExport(const char* configuration, const char* notes, void (*receive)(void*, const char*, const char*),
                         void* context);

namespace fmu {
namespace {

std::string refusal(const std::string& text) {
  try {
    Blueprint::of(read_configuration(text));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Configuration, IsReadAsWritten) {
  const Configuration all{.tcas = 12,
                          .segments = 6,
                          .has_creep = true,
                          .has_moving_states_only = true,
                          .starts = {{"mass", "2"}, {"scheme", "midpoint"}}};
  EXPECT_EQ(read_configuration(text_of(all)), all);
  EXPECT_EQ(read_configuration(""), Configuration());
  EXPECT_EQ(read_configuration("\r\n  tcas   7 \n\n").tcas, 7u);
}

TEST(Configuration, NamesWhatItRefuses) {
  const std::map<std::string, std::string> cases{
      {"tcas 13", "tcas = '13'; allowed: 1 to 12"},
      {"tcas 0", "allowed: 1 to 12"},
      {"tcas", "tcas = ''"},
      {"tcas 3.5", "tcas = '3.5'"},
      {"segments 7", "allowed: 1 to 6"},
      {"\nsize 3", "line 2: unknown entry 'size'; allowed: tcas, segments, ports, creep, states, start"},
      {"creep yes", "creep = 'yes'; allowed: true, false"},
      {"states some", "allowed: all, moving"},
      {"start mass", "needs the name of a variable and a value"},
      {"tcas 3 4", "'4' is too much"},
      {"start weight 1", "'weight' is no parameter or input"},
      {"start x 1", "'x' is no parameter or input"},
      {"start mass 11", "start value '11' of mass refused; allowed: 0.1 to 10"},
      {"start mass nan", "start value 'nan' of mass refused"},
      {"start scheme euler", "midpoint, classical"},
      {"start masses 1.5", "start value '1.5' of masses refused"},
      {"states moving\nstart damping 100\nstart mass 1", "damping is above 10 times the mass"},
  };
  for (const auto& [text, words] : cases) EXPECT_NE(refusal(text).find(words), std::string::npos) << refusal(text);
}

/// What tcaExport hands over, in a folder as an FMU is unpacked to.
class Exported {
 public:
  explicit Exported(const std::string& configuration, const std::string& name = "with space") {
    EXPECT_EQ(tcaExport(configuration.c_str(), "# Notes\nfor all", take, this), 0) << files["error"];
    root_ = std::filesystem::temp_directory_path() / ("fmus configuration " + std::to_string(++count_) + name);
    std::filesystem::create_directories(root_ / "resources");
    std::ofstream(root_ / "resources" / "configuration.txt") << files["resources/configuration.txt"];
    const std::string& xml = files["modelDescription.xml"];
    const std::size_t start = xml.find("guid=\"") + 6;
    guid = xml.substr(start, xml.find('"', start) - start);
    std::string path = (root_ / "resources").string();
    for (std::size_t at = 0; (at = path.find(' ', at)) != std::string::npos;) path.replace(at, 1, "%20");
    uri = "file://" + path;
  }
  ~Exported() { std::filesystem::remove_all(root_); }

  fmi2Component instantiate(const std::string& with, fmi2Type type = fmi2CoSimulation) {
    callbacks.logger = log;
    callbacks.componentEnvironment = this;
    return fmi2Instantiate("probe", type, with.c_str(), uri.c_str(), &callbacks, fmi2False, fmi2True);
  }

  static void log(fmi2ComponentEnvironment here, fmi2String, fmi2Status, fmi2String, fmi2String text, ...) {
    static_cast<Exported*>(here)->message = text;
  }
  static void take(void* context, const char* path, const char* content) {
    static_cast<Exported*>(context)->files[path] = content;
  }

  std::map<std::string, std::string> files;
  std::string guid, uri, message;
  fmi2CallbackFunctions callbacks{};

 private:
  std::filesystem::path root_;
  static inline int count_ = 0;
};

double real(fmi2Component fmu, const std::string& name) {
  const auto vr = probe::reference(name);
  double value = probe::kNaN;
  EXPECT_EQ(fmi2GetReal(fmu, &vr, 1, &value), fmi2OK);
  return value;
}

TEST(Export, GivesTheDefaultWithoutConfiguration) {
  Exported same("");
  EXPECT_EQ(same.files["modelDescription.xml"], model_description(Blueprint::get()));
  EXPECT_NE(same.files["documentation/index.html"].find("<h2>Notes</h2>"), std::string::npos);
}

TEST(Export, ReportsAnError) {
  std::map<std::string, std::string> files;
  const auto take = [](void* context, const char* path, const char* content) {
    (*static_cast<std::map<std::string, std::string>*>(context))[path] = content;
  };
  EXPECT_EQ(tcaExport("tcas 40", nullptr, take, &files), 1);
  EXPECT_NE(files["error"].find("allowed: 1 to 12"), std::string::npos);
  EXPECT_EQ(files.size(), 1u);
}

TEST(Export, StartValuesAreThoseOfTheInstance) {
  Exported heavy("start mass 2\nstart force 0.5\nstart masses 2\nstart is_clamped true");
  EXPECT_NE(heavy.files["modelDescription.xml"].find("max=\"10\" start=\"2\""), std::string::npos);
  const fmi2Component fmu = heavy.instantiate(heavy.guid);
  ASSERT_NE(fmu, nullptr) << heavy.message;
  for (const bool again : {false, true}) {
    EXPECT_EQ(fmi2EnterInitializationMode(fmu), fmi2OK);
    EXPECT_EQ(real(fmu, "mass"), 2.0) << again;
    EXPECT_EQ(real(fmu, "force"), 0.5) << again;
    const auto mass = probe::reference("mass");
    const double lighter = 1.0;
    EXPECT_EQ(fmi2SetReal(fmu, &mass, 1, &lighter), fmi2OK);
    EXPECT_EQ(fmi2ExitInitializationMode(fmu), fmi2OK);
    EXPECT_EQ(fmi2DoStep(fmu, 0.0, 0.1, fmi2True), fmi2OK);
    EXPECT_EQ(fmi2Reset(fmu), fmi2OK);
  }
  fmi2FreeInstance(fmu);
}

TEST(Export, KeepsTheStatesThatMove) {
  Exported two("states moving\nstart masses 2");
  const auto blueprint = Blueprint::of(read_configuration("states moving\nstart masses 2"));
  ASSERT_EQ(blueprint->states.size(), 4u);  // of 20
  EXPECT_EQ(blueprint->rows[blueprint->states[2]].name, "velocity[1]");
  const fmi2Component fmu = two.instantiate(two.guid, fmi2ModelExchange);
  ASSERT_NE(fmu, nullptr) << two.message;
  EXPECT_EQ(fmi2EnterInitializationMode(fmu), fmi2OK);
  EXPECT_EQ(fmi2ExitInitializationMode(fmu), fmi2OK) << two.message;
  EXPECT_EQ(fmi2EnterContinuousTimeMode(fmu), fmi2OK);
  const double x[4] = {0.1, 0.2, 3.0, 4.0};
  double y[4], dx[4], many[20];
  EXPECT_EQ(fmi2SetContinuousStates(fmu, x, 4), fmi2OK);
  EXPECT_EQ(fmi2GetContinuousStates(fmu, y, 4), fmi2OK);
  EXPECT_EQ(fmi2GetDerivatives(fmu, dx, 4), fmi2OK);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(y[i], x[i]);
  EXPECT_EQ(dx[0], 3.0);
  EXPECT_EQ(dx[1], 4.0);
  EXPECT_NEAR(dx[2], 4.0 * (0.2 - 2 * 0.1) - 0.1 * 3.0, 1e-14);
  EXPECT_NEAR(dx[3], 4.0 * (0.1 - 0.2) - 0.1 * 4.0, 1e-14);
  EXPECT_EQ(fmi2GetContinuousStates(fmu, many, 20), fmi2Error);
  const auto unknown = static_cast<unsigned>(blueprint->rows.size() - 1),
             known = static_cast<unsigned>(blueprint->states[1]);
  const double one = 1.0;
  double slope = 0.0;  // of velocity[2]' by position[2]
  EXPECT_EQ(fmi2GetDirectionalDerivative(fmu, &unknown, 1, &known, 1, &one, &slope), fmi2OK) << two.message;
  EXPECT_NEAR(slope, -4.0, 1e-12);
  fmi2FreeInstance(fmu);
}

TEST(Export, RefusesParametersThatMoveStatesLeftOut) {
  Exported two("states moving\nstart masses 2");
  for (const bool is_exchange : {true, false}) {
    const fmi2Component fmu = two.instantiate(two.guid, is_exchange ? fmi2ModelExchange : fmi2CoSimulation);
    ASSERT_NE(fmu, nullptr) << two.message;
    const auto masses = probe::reference("masses");
    const int three = 3;
    EXPECT_EQ(fmi2SetInteger(fmu, &masses, 1, &three), fmi2OK);
    EXPECT_EQ(fmi2EnterInitializationMode(fmu), fmi2OK);
    EXPECT_EQ(fmi2ExitInitializationMode(fmu), is_exchange ? fmi2Error : fmi2OK);
    if (is_exchange) {
      EXPECT_NE(two.message.find("position[3] moves at these parameters"), std::string::npos) << two.message;
    }
    fmi2FreeInstance(fmu);
  }
  Exported none("states moving\nstart scheme midpoint");  // of steps only: no states at all
  EXPECT_EQ(none.files["modelDescription.xml"].find("derivative="), std::string::npos);
}

TEST(Export, WithoutStatesOutputsDependOnTheInputsThatActedOnStates) {
  const auto blueprint = Blueprint::of(read_configuration("states moving\nstart scheme midpoint"));
  const auto depends = [&](const char* name) {
    return std::ranges::find(blueprint->rows, std::string(name), &Variable::name)->depends_on;
  };
  EXPECT_EQ(depends("x"), std::vector<std::string>{"force"});
  EXPECT_EQ(depends("reading"), (std::vector<std::string>{"bias", "force"}));
  EXPECT_EQ(depends("builds"), std::vector<std::string>{});
}

TEST(Export, RefusesAStaleOrForeignDescription) {
  Exported heavy("start mass 2"), light("start mass 0.5");
  EXPECT_NE(heavy.guid, light.guid);
  EXPECT_EQ(heavy.instantiate(light.guid), nullptr);
  EXPECT_NE(heavy.message.find(heavy.guid + " for the configuration in its resources"), std::string::npos)
      << heavy.message;
  heavy.uri = "file:///no/such/folder";
  EXPECT_EQ(heavy.instantiate(heavy.guid), nullptr);
  EXPECT_NE(heavy.message.find("configuration.txt"), std::string::npos) << heavy.message;
  heavy.uri = "https://example.org/resources";
  EXPECT_EQ(heavy.instantiate(heavy.guid), nullptr);
  EXPECT_NE(heavy.message.find("URI of a folder"), std::string::npos) << heavy.message;
}

TEST(Export, StatesOfAnotherConfigurationAreRefused) {
  Exported heavy("start mass 2"), light("start mass 0.5");
  const fmi2Component a = heavy.instantiate(heavy.guid), b = light.instantiate(light.guid);
  ASSERT_TRUE(a && b);
  fmi2FMUstate state = nullptr, other = nullptr;
  size_t size = 0;
  EXPECT_EQ(fmi2GetFMUstate(a, &state), fmi2OK);
  EXPECT_EQ(fmi2SerializedFMUstateSize(a, state, &size), fmi2OK);
  std::vector<char> bytes(size);
  EXPECT_EQ(fmi2SerializeFMUstate(a, state, bytes.data(), size), fmi2OK);
  EXPECT_EQ(fmi2DeSerializeFMUstate(b, bytes.data(), size, &other), fmi2Error);
  EXPECT_NE(light.message.find("configuration"), std::string::npos) << light.message;
  fmi2FreeInstance(a);
  fmi2FreeInstance(b);
}

TEST(Resources, AreFoundByUri) {
  EXPECT_EQ(folder_of("file:///tmp/a%20b/resources"), "/tmp/a b/resources");
  EXPECT_EQ(folder_of("file://localhost/tmp/r"), "/tmp/r");
  EXPECT_EQ(folder_of("file:/tmp/r"), "/tmp/r");
  EXPECT_EQ(folder_of("/tmp/100%"), "/tmp/100%");
  EXPECT_EQ(folder_of("file:///C:/fmu/resources"), "C:/fmu/resources");
  EXPECT_THROW(folder_of("http://host/r"), Error);
  EXPECT_THROW(folder_of("file:///tmp%00/r"), Error);
}

}  // namespace
}  // namespace fmu
