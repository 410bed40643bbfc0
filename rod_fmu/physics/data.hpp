// Plain data of one rod: parameters (start values: parameter set `fig3`), inputs and outputs. SI units, temperatures in
// kelvin. Vectors of inputs and of the tip are in the fixed frame, whose z axis runs along the straight rod from its
// clamp.
#pragma once

#include <array>
#include <cstddef>
#include <type_traits>

#include "core/capacity.hpp"
#include "core/time_polynomial.hpp"
#include "numerics/sizes.hpp"

namespace rod {

inline constexpr int kMinGridPoints = 5, kMaxGridPoints = 401;

enum class Strains : int { bending = 1, extensible, kirchhoff, cosserat };
enum class Closure : int { inside = 1, exchanged };
enum class Law : int { wire = 1, measured };
enum class Pitch : int { frozen = 1, current };
enum class Profile : int { round = 1, given };
enum class Contact : int { sliding = 1, bonded };
enum class Ends : int { free = 1, tethered };
enum class Method : int { backward_euler = 1, rosenbrock, midpoint, bdf, pade_euler, rosenbrock_3 };

using Polynomial = core::Cubic;  // value and three time derivatives of an input at the start of a step
using Triple = std::array<double, 3>;
template <class T>
using PerTca = std::array<T, kMaxTcas>;

/// One TCA: its routing through the body, and its law.
struct Tca {
  double azimuth = 0.0;                     // rad, at the clamp
  double helix = 0.0;                       // rad/m, twist of the routing along the rod
  double offset = 2.5e-3;                   // m, distance from the centreline at the start of its span
  double offset_end = 2.5e-3;               // m, at the end; linear between
  int first_segment = 1, last_segment = 1;  // its span
  Law law = Law::wire;
  Pitch pitch = Pitch::frozen;
  double wire_length = 130e-3;     // m
  double wire_diameter = 0.65e-3;  // m
  double coils = 37.5;             // 1
  double twists = 100.0;           // 1
  double E = 560e6;                // Pa
  double rho_T = 6.5e-4;           // 1/K
  int chirality = 1;               // +1 extends when heated, -1 contracts
  int handedness = 1;              // of the coil, +1 or -1: sense in which a tethered TCA turns
  double stiffness = 10.0;         // N/m, law = measured
  double stiffening = 0.0;         // N/m2, law = measured: tension per square of the extension
  double stroke = 1.5e-4;          // m/K, law = measured
  double stroke_curvature = 0.0;   // m/K2, law = measured
  double stop = -1.0;              // m, law = measured: displacement at which the coils touch; far away by default
  double stop_width = 1e-3;        // m, law = measured: over which the stop sets in
  double stop_stiffness = 0.0;     // N/m, law = measured: of the touching coils; 0: no stop
  double creep_compliance = 0.0;   // m/N, law = measured: creep per tension after a long time; 0: no creep
  double creep_time = 10.0;        // s, law = measured: retardation time of the creep at T_0
  double creep_activation = 0.0;   // K, law = measured: of its rate, activation energy over the gas constant
};

/// One segment of the body, between two cross-sections.
struct Segment {
  double length = 40e-3;                              // m
  double radius = 5e-3;                               // m, at its start
  double radius_end = 5e-3;                           // m, at its end; linear between
  double E = 37.8e3;                                  // Pa
  double nu = 0.5;                                    // 1
  double rho = 1040.0;                                // kg/m3
  double shear_factor = 1.0;                          // 1
  double retardation = 0.0;                           // s, Kelvin-Voigt: damping = retardation * stiffness
  std::array<double, 6> stiffness{1, 1, 1, 1, 1, 1};  // N.m2 (x, y, z), N (x, y, z): bending, torsion; shear, axial
  Triple curvature{};                                 // 1/m, of the unloaded body
  int order = 4;                                      // degree of the strain polynomials
  Strains strains = Strains::cosserat;
};

/// Rigid body at the tip of the rod.
struct TipBody {
  double mass = 0.0;  // kg
  Triple inertia{};   // kg.m2, about its centre, in the axes of the tip
  Triple centre{};    // m, from the tip, in the axes of the tip
};

struct Parameters {
  explicit Parameters(std::size_t tca_count = core::kDefaultTcas, std::size_t segment_count = core::kDefaultSegments)
      : tcas(tca_count), segments(segment_count) {
    for (std::size_t i = 0; i < tcas; ++i) {
      tca[i].azimuth = 6.283185307179586 * static_cast<double>(i) / static_cast<double>(tcas);
      tca[i].last_segment = static_cast<int>(segments);
    }
    for (std::size_t j = 0; j < segments; ++j) segment[j].length /= static_cast<double>(segments);
  }

  std::size_t tcas, segments;
  std::array<Tca, kMaxTcas> tca;
  std::array<Segment, kMaxSegments> segment;
  Profile profile = Profile::round;
  TipBody tip_body;
  Contact contact = Contact::sliding;
  Ends ends = Ends::free;
  double T_0 = 298.15;  // K, the temperature of zero stroke
  Closure closure = Closure::inside;
  bool planar = false;   // motion in the plane through the axis at this azimuth alone
  double plane = 0.0;    // rad
  int grid_points = 21;  // of the method pade_euler
  bool dynamic = true;
  bool start_at_equilibrium = false;
  Method method = Method::rosenbrock;
  double tolerance = 1e-6;  // relative
  bool has_load = false;    // the body has ports: the stations' forces may differ from 0

  /// Gives every segment, or every TCA, the same value of a quantity.
  template <class Value>
  void set(Value Segment::*quantity, std::type_identity_t<Value> value) {
    for (Segment& each : segment) each.*quantity = value;
  }
  template <class Value>
  void set(Value Tca::*quantity, std::type_identity_t<Value> value) {
    for (Tca& each : tca) each.*quantity = value;
  }
  /// Length of the body [m].
  double length() const {
    double sum = 0.0;
    for (std::size_t j = 0; j < segments; ++j) sum += segment[j].length;
    return sum;
  }
  /// Length of the body in front of segment j, from 0 [m].
  double start_of(std::size_t j) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < j; ++i) sum += segment[i].length;
    return sum;
  }
  /// Length of the straight body along which TCA i lies [m].
  double span_of(std::size_t i) const {
    return start_of(static_cast<std::size_t>(tca[i].last_segment)) -
           start_of(static_cast<std::size_t>(tca[i].first_segment - 1));
  }
};

struct Inputs {
  std::size_t tcas = core::kDefaultTcas;  // TCAs and stations whose inputs are used
  std::size_t stations = 0;
  PerTca<Polynomial> T = filled(298.15);   // K
  PerTca<Polynomial> delta_guess{};        // m, used when closure = exchanged
  std::array<Polynomial, 3> gravity{};     // m/s2
  std::array<Polynomial, 3> tip_force{};   // N
  std::array<Polynomial, 3> tip_moment{};  // N.m
  /// Force per length of the straight body at the evenly spaced stations, linear between them [N/m].
  std::array<std::array<Polynomial, 3>, kShapeStations> load{};

 private:
  static constexpr PerTca<Polynomial> filled(double value) {
    PerTca<Polynomial> all{};
    for (auto& each : all) each[0] = value;
    return all;
  }
};

/// Parts of the outputs that are calculated apart, where they are asked for: one bit each.
namespace part {
inline constexpr unsigned tip_position = 1, tip_orientation = 2, tip_velocity = 4, shape = 8, tcas = 16, energy = 32,
                          clamp = 64, out_of_plane = 128, spatial_error = 256;
inline constexpr unsigned motion = tip_position | tip_orientation | tip_velocity | shape | tcas | energy | out_of_plane;
}  // namespace part

struct Outputs {
  PerTca<double> delta{}, delta_rate{};              // m, m/s
  PerTca<double> N{};                                // N, tension positive
  PerTca<double> creep{};                            // m, of TCAs that creep
  Triple tip_p{};                                    // m
  Triple tip_euler{};                                // rad, R = Rx(alpha) Ry(beta) Rz(gamma)
  std::array<double, 4> tip_quaternion{1, 0, 0, 0};  // scalar first
  Triple tip_v{};                                    // m/s
  Triple base_force{}, base_moment{};                // N, N.m: of the clamp on the rod
  double energy_elastic = 0, energy_tca = 0, energy_kinetic = 0, energy_gravity = 0, energy_dissipated = 0;  // J
  double spatial_error = 0;                      // m, estimate, of the strain polynomials
  double evaluations = 0;                        // 1, number of evaluations of the residual so far
  double out_of_plane = 0;                       // 1, largest strain that forces across the plane of a planar
                                                 // rod would cause
  std::array<Triple, kShapeStations> shape{};    // m
  std::array<Triple, kShapeStations> shape_v{};  // m/s
};

/// Retardation time of silicone [s], the start value of an FMU: an undamped manipulator that a host drives by steps of
/// its inputs rings for ever.
inline constexpr double kSilicone = 5e-3;

struct Data {
  explicit Data(std::size_t tcas = core::kDefaultTcas, std::size_t segments = core::kDefaultSegments,
                bool has_ports = false)
      : parameters(tcas, segments) {
    parameters.set(&Segment::retardation, kSilicone);
    parameters.has_load = has_ports;
    inputs.tcas = tcas;
    inputs.stations = has_ports ? kShapeStations : 0;
  }

  Parameters parameters;
  Inputs inputs;
  Outputs outputs;
};

}  // namespace rod
