// Plain data of one rod: parameters (start values: parameter set `fig3`), inputs and outputs. SI units, temperatures in
// kelvin. Vectors of inputs and of the tip are in the fixed frame, whose z axis runs along the straight rod from its
// clamp.
#pragma once

#include <array>
#include <cstddef>

#include "core/time_polynomial.hpp"
#include "numerics/sizes.hpp"

namespace rod {

inline constexpr int kMinGridPoints = 5, kMaxGridPoints = 401;

enum class Strains : int { bending = 1, extensible, kirchhoff, cosserat };
enum class Closure : int { inside = 1, exchanged };
enum class Law : int { wire = 1, measured };
enum class Pitch : int { frozen = 1, current };
enum class Profile : int { round = 1, given };
enum class Method : int { backward_euler = 1, rosenbrock, midpoint, bdf, pade_euler, rosenbrock_3 };

using Polynomial = core::Cubic;  // value and three time derivatives of an input at the start of a step
using Triple = std::array<double, 3>;
template <class T>
using PerTca = std::array<T, kTcas>;

struct Parameters {
  double body_radius = 5e-3;       // m
  double body_length = 40e-3;      // m
  double body_E = 37.8e3;          // Pa
  double body_nu = 0.5;            // 1
  double body_rho = 1040.0;        // kg/m3
  double body_shear_factor = 1.0;  // 1
  double body_retardation = 0.0;   // s, Kelvin-Voigt: damping = retardation * stiffness
  Profile body_profile = Profile::round;
  std::array<double, 6> body_stiffness{1, 1, 1,
                                       1, 1, 1};  // N.m2 (x, y, z), N (x, y, z): bending, torsion; shear, axial
  Triple body_curvature{};                        // 1/m, of the unloaded body
  double tca_offset = 2.5e-3;                     // m
  PerTca<double> tca_azimuth = even_azimuths();   // rad
  PerTca<double> tca_helix{};                     // rad/m, twist of the routing along the rod
  Law tca_law = Law::wire;
  Pitch tca_pitch = Pitch::frozen;
  double tca_wire_length = 130e-3;     // m
  double tca_wire_diameter = 0.65e-3;  // m
  double tca_coils = 37.5;             // 1
  double tca_twists = 100.0;           // 1
  double tca_E = 560e6;                // Pa
  double tca_rho_T = 6.5e-4;           // 1/K
  int tca_chirality = 1;               // +1 extends when heated, -1 contracts
  double tca_stiffness = 10.0;         // N/m, law = measured
  double tca_stroke = 1.5e-4;          // m/K, law = measured
  double T_0 = 298.15;                 // K, the temperature of zero stroke
  Closure closure = Closure::inside;
  Strains strains = Strains::cosserat;
  bool planar = false;   // motion in the plane through the axis at this azimuth alone
  double plane = 0.0;    // rad
  int order = 4;         // degree of the strain polynomials
  int grid_points = 21;  // of the method pade_euler
  bool dynamic = true;
  bool start_at_equilibrium = false;
  Method method = Method::rosenbrock;
  double tolerance = 1e-6;  // relative

 private:
  static constexpr PerTca<double> even_azimuths() {
    PerTca<double> azimuth{};
    for (std::size_t i = 0; i < kTcas; ++i) azimuth[i] = 6.283185307179586 * i / kTcas;
    return azimuth;
  }
};

struct Inputs {
  PerTca<Polynomial> T = filled(298.15);   // K
  PerTca<Polynomial> delta_guess{};        // m, used when closure = exchanged
  std::array<Polynomial, 3> gravity{};     // m/s2
  std::array<Polynomial, 3> tip_force{};   // N
  std::array<Polynomial, 3> tip_moment{};  // N.m

 private:
  static constexpr PerTca<Polynomial> filled(double value) {
    PerTca<Polynomial> all{};
    for (auto& each : all) each[0] = value;
    return all;
  }
};

struct Outputs {
  PerTca<double> delta{}, delta_rate{};              // m, m/s
  PerTca<double> N{};                                // N, tension positive
  Triple tip_p{};                                    // m
  Triple tip_euler{};                                // rad, R = Rx(alpha) Ry(beta) Rz(gamma)
  std::array<double, 4> tip_quaternion{1, 0, 0, 0};  // scalar first
  Triple tip_v{};                                    // m/s
  double energy_elastic = 0, energy_tca = 0, energy_kinetic = 0, energy_gravity = 0, energy_dissipated = 0;  // J
  double spatial_error = 0;                    // m, estimate, of the strain polynomials
  double evaluations = 0;                      // 1, number of evaluations of the residual so far
  double out_of_plane = 0;                     // 1, largest strain that forces across the plane of a planar
                                               // rod would cause
  std::array<Triple, kShapeStations> shape{};  // m
};

struct Data {
  Parameters parameters;
  Inputs inputs;
  Outputs outputs;
};

}  // namespace rod
