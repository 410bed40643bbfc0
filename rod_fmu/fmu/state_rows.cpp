// States: coefficients of the strain polynomials, their rates, the energy dissipated.
#include <string>
#include <vector>

#include "fmu/rows.hpp"

namespace rod {

void add_states(Table& table, std::size_t segments, bool has_ports) {
  constexpr const char* kind[6] = {"curvature", "curvature", "twist", "shear", "shear", "stretch"};
  const auto name = [](const char* vector, std::size_t a, std::size_t c) {
    return std::string(vector) + "[" + std::to_string(a + 1) + "," + std::to_string(c + 1) + "]";
  };
  const auto description = [&](std::size_t a, std::size_t c) {
    return std::string(kind[c]) + ", " + kAxes[c % 3] + (c < 3 ? ", times the length" : "") +
           ": coefficient of the Legendre polynomial of degree " + std::to_string(a % (kMaxOrder + 1)) +
           (segments > 1 ? " in segment " + std::to_string(a / (kMaxOrder + 1) + 1) : "");
  };
  std::vector<std::string> acting = {"strain", "strain_rate", "T", "delta_guess", "gravity", "tip_force", "tip_moment"};
  if (has_ports) acting.push_back("shape.f");
  constexpr std::size_t terms = kMaxOrder + 1;  // the first index goes on from segment to segment
  for (std::size_t a = 0; a < segments * terms; ++a)
    for (std::size_t c = 0; c < 6; ++c)
      table.state(name("strain", a, c), "1", "1/s", description(a, c))
          .nominal(0.1)
          .depends({name("strain_rate", a, c)});
  for (std::size_t a = 0; a < segments * terms; ++a)
    for (std::size_t c = 0; c < 6; ++c)
      table.state(name("strain_rate", a, c), "1/s", "1/s2", "rate of " + description(a, c)).depends(acting);
  table.state("dissipation", "J", "W", "energy dissipated by the damping since the start")
      .nominal(1e-4)
      .depends({"strain_rate"});
}

}  // namespace rod
