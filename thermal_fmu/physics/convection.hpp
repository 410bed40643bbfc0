// Heat transfer coefficient h of the body's surface, a horizontal cylinder in air at 1 atm:
//   constant  the parameter h
//   free      Churchill and Chu, Int. J. Heat Mass Transfer 18 (1975) 1049:
//             Nu = (0.60 + 0.387 Ra^(1/6) / [1 + (0.559/Pr)^(9/16)]^(8/27))^2,   Ra <= 1e12
//   forced    Churchill and Bernstein, J. Heat Transfer 99 (1977) 300, flow across the cylinder:
//             Nu = 0.3 + 0.62 Re^(1/2) Pr^(1/3) / [1 + (0.4/Pr)^(2/3)]^(1/4) [1 + (Re/282000)^(5/8)]^(4/5),
//             together with free convection, Nu^4 = Nu_forced^4 + Nu_free^4 (transverse flows, Incropera and DeWitt,
//             Fundamentals of Heat and Mass Transfer, section 9.9), so that still air has a coefficient too.
// Nu = h D/k with the properties of air at the mean of surface and surroundings; the surface is taken at its mean.
#pragma once

#include <cmath>

#include "physics/parameters.hpp"

namespace thermal {

/// Properties of dry air at 1 atm and a temperature [K], 200 to 600 K within 2 % (Sutherland's laws: White, Viscous
/// Fluid Flow, 3rd ed., tables 1-2 and 1-3).
struct Air {
  explicit Air(double T)
      : conductivity(0.0241 * std::pow(T / 273.0, 1.5) * (273.0 + 194.0) / (T + 194.0)),
        kinematic_viscosity(1.716e-5 * std::pow(T / 273.0, 1.5) * (273.0 + 111.0) / (T + 111.0) * 287.05 * T /
                            101325.0),
        prandtl(kinematic_viscosity * kHeatCapacity * 101325.0 / (287.05 * T) / conductivity) {}

  static constexpr double kHeatCapacity = 1007.0;  // [J/(kg K)]
  double conductivity;                             // [W/(m K)]
  double kinematic_viscosity;                      // [m2/s]
  double prandtl;
};

class Convection {
 public:
  explicit Convection(const Parameters& p)
      : kind_(p.convection), diameter_(2.0 * p.body.radius), constant_(p.h), reference_(reference(p)) {}

  bool is_constant() const { return kind_ == ConvectionKind::constant; }

  /// The coefficient [W/(m2 K)] that matrices are built with: the levels add what h differs from it.
  double reference() const { return reference_; }

  /// h [W/(m2 K)] at the mean temperature of the surface, of the surroundings [K] and a speed of the air [m/s].
  double coefficient(double T_surface, double T_ambient, double speed) const {
    if (is_constant()) return constant_;
    // Temperatures that an iteration passes through on its way need a coefficient as well.
    constexpr double kColdest = 150.0, kHottest = 2000.0;  // [K]
    const double film = std::clamp(0.5 * (T_surface + T_ambient), kColdest, kHottest);
    const Air air(film);
    const double free = free_nusselt(air, T_surface - T_ambient, film);
    const double nusselt = kind_ == ConvectionKind::free
                               ? free
                               : std::pow(std::pow(forced_nusselt(air, speed), 4) + std::pow(free, 4), 0.25);
    return nusselt * air.conductivity / diameter_;
  }

 private:
  double free_nusselt(const Air& air, double difference, double film) const {
    constexpr double kGravity = 9.81;  // [m/s2]
    // Rounds off the corner of |difference|, where the sixth root is steep [K].
    constexpr double kRounded = 0.1;
    const double diffusivity = air.kinematic_viscosity / air.prandtl;
    const double rayleigh = kGravity / film * std::hypot(difference, kRounded) * std::pow(diameter_, 3) /
                            (air.kinematic_viscosity * diffusivity);
    const double shape = std::pow(1.0 + std::pow(0.559 / air.prandtl, 9.0 / 16.0), 8.0 / 27.0);
    return std::pow(0.60 + 0.387 * std::pow(rayleigh, 1.0 / 6.0) / shape, 2);
  }

  double forced_nusselt(const Air& air, double speed) const {
    const double reynolds = std::abs(speed) * diameter_ / air.kinematic_viscosity;
    const double shape = std::pow(1.0 + std::pow(0.4 / air.prandtl, 2.0 / 3.0), 0.25);
    return 0.3 + 0.62 * std::sqrt(reynolds) * std::cbrt(air.prandtl) / shape *
                     std::pow(1.0 + std::pow(reynolds / 282000.0, 5.0 / 8.0), 0.8);
  }

  double reference(const Parameters& p) const {
    constexpr double kRise = 20.0;  // of the surface [K]: typical of a run
    constexpr double kSpeed = 1.0;  // of the air [m/s]: a fan
    return coefficient(p.T_0 + kRise, p.T_0, kind_ == ConvectionKind::forced ? kSpeed : 0.0);
  }

  ConvectionKind kind_;
  double diameter_, constant_, reference_;
};

}  // namespace thermal
