// Interface of the loops over the nodes of a uniform rod, or of one segment of a body: its constants, quantities that a
// loop leaves behind, and one function per task. Each function exists for motion in space and in a plane, and for every
// number of nodes.
#pragma once

#include <array>
#include <vector>

#include "numerics/field.hpp"
#include "numerics/quadrature.hpp"
#include "physics/data.hpp"
#include "physics/loads.hpp"

namespace rod {

/// Inertia along a segment whose section changes, at its nodes.
struct SegmentInertia {
  ScalarField mass;         // rho A [kg/m]
  ScalarField mass_beyond;  // int of it from the node to the segment's end, over the segment's length [kg/m]
  ScalarField rotary;       // rho I [kg m]
  double mass_total = 0.0;  // mean of rho A [kg/m]
};

/// Constants of one rod, or of one segment, in the rod's frame.
struct RodConstants {
  const Quadrature* grid = nullptr;
  bool planar = false;
  double length = 0.0;                            // L [m]
  double mass = 0.0;                              // rho A [kg/m]
  Vec3 inertia;                                   // rho diag(I, I, 2 I) [kg m]
  Vec3 kappa, lambda{0.0, 0.0, 1.0};              // strains of the unloaded rod xi*: curvature times L, and tangent [1]
  int terms = 0;                                  // polynomials per strain component: degree + 1
  int count = 0;                                  // strain components, the first ones of:
  std::array<int, 6> components{};                // 0..2: bending, bending, torsion; 3..5: shear, shear, stretch
  std::size_t tcas = 0;                           // TCAs, of which some may not lie in this segment
  std::vector<VectorField> offset, slope;         // routing r_i/L and its derivative dr_i/ds at the nodes [1]
  std::array<bool, kMaxTcas> is_routed{};         // TCA i lies in this segment
  const SegmentInertia* inertia_along = nullptr;  // of a segment; null for a uniform rod

  int unknowns() const { return terms * count; }
};

/// Motion of a section in the rod's fixed frame: where a segment starts, and where it ends.
struct SectionMotion {
  Rotation<double> R{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  std::array<double, 4> quaternion{1, 0, 0, 0};  // the same, scalar first
  Vec3 p, v, a;                                  // m, m/s, m/s2
  Vec3 omega, alpha;                             // 1/s, 1/s2
};

/// Variation of a section's motion: rotation, angular velocity and acceleration, position's second derivative.
struct SectionVariation {
  Vec3 theta, omega, alpha, a;  // 1, 1/s, 1/s2, m/s2
};

/// Force [N] and moment [N m] that act on a section, or that it passes on.
struct Wrench {
  Vec3 force, moment;
};

/// Kinematics and internal forces at the nodes, left by an evaluation for derivatives and outputs. Vectors are in the
/// rod's fixed frame unless a name says "body". Never part of a state.
struct Kinematics {
  RotationField R;
  VectorField l, n, m;                         // p'/L [1], force n L [N m], moment m [N m]
  VectorField k1, k2, l1, l2;                  // R dkappa/dt L, R d2kappa/dt2 L, R dlambda/dt, R d2lambda/dt2
  VectorField omega, alpha, omega_body, hdot;  // [1/s], [1/s2], [1/s]; dh/dt L [N m]
  VectorField velocity;                        // dp/dt / L [1/s]
  VectorField swing;                           // omega x p' + 2 R dlambda/dt, whose product with omega accelerates
  std::vector<VectorField> t, arm;             // tangent t_i of TCA i [1], its arm r_i x t_i / L [1]
  std::vector<ScalarField> inverse_length;     // 1/|u_i| [1]
  PerTca<double> path{};                       // int |u_i| ds / L [1]
  std::array<double, 4> tip_quaternion{1, 0, 0, 0};  // scalar first
  SectionMotion base, tip;                           // of a segment
  bool moving = false;                               // the last evaluation was one of dynamics
};

/// Where a loop writes the gradient of delta_i in the unknowns [m], one array per TCA.
using Gradients = std::array<double*, kMaxTcas>;

/// Writes orientations and tangents.
using PositionsLoop = void (*)(const RodConstants&, const double* q, Kinematics&);
/// Writes the paths of the TCAs and the gradients b_i = d delta_i/dq = L int Phi^T [r_i x t_i; t_i] ds.
using PathsLoop = void (*)(const RodConstants&, const double* q, Kinematics&, const Gradients& b);
/// Writes velocities; needs the positions.
using VelocitiesLoop = void (*)(const RodConstants&, const double* v, Kinematics&);

/// Writes, for a rod at rest, the positions, the gradients b and the load's part of the residual,
/// r = -int Phi^T [R^T m; R^T n] ds.
using StaticsLoop = void (*)(const RodConstants&, const double* q, const BodyLoads&, Kinematics&, double* r,
                             const Gradients& b);

/// The same for a moving rod; n and m then contain the inertia.
using DynamicsLoop = void (*)(const RodConstants&, const double* q, const double* v, const double* a, const BodyLoads&,
                              Kinematics&, double* r, const Gradients& b);

/// Writes the derivative of r + sum N_i b_i at constant tensions N_i [N], column by column: weights[0] d/dq +
/// weights[1] d/dv + weights[2] d/da, at the point of the last evaluation.
using TangentLoop = void (*)(const RodConstants&, const Kinematics&, const std::array<double, 3>& weights,
                             const PerTca<double>& tension, double* J);

/// Writes the derivative of r in the direction (0, dv, da).
using RateLoop = void (*)(const RodConstants&, const Kinematics&, const double* dv, const double* da, double* dr);

/// Returns the largest error of the centreline and of the displacements [m] at an equilibrium with these tensions [N];
/// stiffness[c] is that of a constant strain of component c [J]. See spatial_error.cpp.
using SpatialErrorLoop = double (*)(const RodConstants&, const Kinematics&, const BodyLoads&,
                                    const PerTca<double>& tension, const std::array<double, 6>& stiffness,
                                    const double* q);

// The same for one segment of a body, whose start moves. The start's motion is in w.base, what follows from it at the
// end in w.tip.

/// Writes positions and the gradients b; of a moving segment also velocities, accelerations and inertia forces.
using SegmentForwardLoop = void (*)(const RodConstants&, const double* q, const double* v, const double* a, bool moving,
                                    Kinematics&, const Gradients& b);
/// Loads of a segment: gravity, wrench at its end, force along it from each node to its end and from its start [N].
struct SegmentLoads {
  Vec3 gravity;
  Wrench end;
  VectorField along;
  Vec3 along_total;
};

/// Writes the load's part of the residual and returns the wrench that the segment passes on at its start; needs the
/// forward loop of the same motion. With `keep` also the internal forces n and m, there; without, inertia is left out.
using SegmentBackwardLoop = Wrench (*)(const RodConstants&, const SegmentLoads&, const Kinematics&, Kinematics* keep,
                                       double* r);

struct SegmentLoops {
  SegmentForwardLoop forward = nullptr;
  SegmentBackwardLoop backward = nullptr;
};

SegmentLoops segment_loops(const RodConstants& segment);

/// One column of the derivative of a segment: of its residual, of the motion of its end, and of the wrench at its
/// start.
struct SegmentColumn {
  double* r;
  SectionVariation tip;
  Wrench base;
};

/// Writes the derivative in strain coefficient `index` (component, then degree), with these weights of d/dq, d/dv and
/// d/da, at a fixed motion of the start and a fixed wrench at the end.
using SegmentStrainColumn = void (*)(const RodConstants&, const Kinematics&, const std::array<double, 3>& weights,
                                     int component, int degree, SegmentColumn&);
/// Writes the derivative in the motion of the start.
using SegmentBaseColumn = void (*)(const RodConstants&, const Kinematics&, const SectionVariation&, SegmentColumn&);
/// Writes the derivative in the wrench at the end.
using SegmentWrenchColumn = void (*)(const RodConstants&, const Kinematics&, const Wrench&, SegmentColumn&);
/// Writes the derivative in the direction (0, dv, da), where the motion of the start varies too.
using SegmentRateColumn = void (*)(const RodConstants&, const Kinematics&, const double* dv, const double* da,
                                   const SectionVariation& start, SegmentColumn&);

struct SegmentTangentLoops {
  SegmentStrainColumn strain = nullptr;
  SegmentBaseColumn base = nullptr;
  SegmentWrenchColumn wrench = nullptr;
  SegmentRateColumn rate = nullptr;
};

SegmentTangentLoops segment_tangent_loops(const RodConstants& segment);

struct ResidualLoops {
  PositionsLoop positions = nullptr;
  PathsLoop paths = nullptr, positions_and_paths = nullptr;
  VelocitiesLoop velocities = nullptr;
  StaticsLoop statics = nullptr;
  DynamicsLoop dynamics = nullptr;
};

struct TangentLoops {
  TangentLoop tangent = nullptr;
  RateLoop rate = nullptr;
};

ResidualLoops residual_loops(const RodConstants& rod);
TangentLoops tangent_loops(const RodConstants& rod);
SpatialErrorLoop spatial_error_loop(const RodConstants& rod);

}  // namespace rod
