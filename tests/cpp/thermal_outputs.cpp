// Every output is written at every level, with every kind of convection that it offers.
#include <gtest/gtest.h>

#include "unwritten_outputs.hpp"

namespace thermal {
namespace {

constexpr double kReduced = 2;       // item of the enumeration `level`
constexpr double kTolerance = 1e-1;  // coarse meshes build fast
constexpr double kStep = 0.1;        // s

TEST(Outputs, AreWrittenAtEveryLevel) {
  for (const std::size_t tcas : {3, 2})
    for (const double level : {1.0, 2.0, 3.0})
      for (const double convection : {1.0, 2.0, 3.0}) {
        if (level == kReduced && convection != 1.0) continue;  // linear, so refused
        fmu::Configuration configuration;
        configuration.tcas = tcas;
        EXPECT_EQ(fmu::unwritten_outputs(configuration,
                                         {{"level", level},
                                          {"convection", convection},
                                          {"tolerance", kTolerance},
                                          {"V[1]", 2.0},
                                          {"air_speed", 1.0},
                                          {"tca.alpha_T[1]", 1e-3}},
                                         kStep),
                  std::vector<std::string>{})
            << tcas << " TCAs, level " << level << ", convection " << convection;
      }
}

}  // namespace
}  // namespace thermal
