// Interface of the loops over the nodes of a rod: constants of one rod, quantities that a loop leaves behind, and one
// function per task. Each function exists for motion in space and in a plane, and for every number of nodes.
#pragma once

#include <array>

#include "numerics/field.hpp"
#include "numerics/quadrature.hpp"
#include "physics/data.hpp"
#include "physics/loads.hpp"

namespace rod {

/// Constants of one rod, in its frame.
struct RodConstants {
  const Quadrature* grid = nullptr;
  bool planar = false;
  double length = 0.0;                           // L [m]
  double mass = 0.0;                             // rho A [kg/m]
  Vec3 inertia;                                  // rho diag(I, I, 2 I) [kg m]
  Vec3 kappa, lambda{0.0, 0.0, 1.0};             // strains of the unloaded rod xi*: curvature times L, and tangent [1]
  int terms = 0;                                 // polynomials per strain component: degree + 1
  int count = 0;                                 // strain components, the first ones of:
  std::array<int, 6> components{};               // 0..2: bending, bending, torsion; 3..5: shear, shear, stretch
  std::array<VectorField, kTcas> offset, slope;  // routing r_i/L and its derivative dr_i/ds at the nodes [1]

  int unknowns() const { return terms * count; }
};

/// Kinematics and internal forces at the nodes, left by an evaluation for derivatives and outputs. Vectors are in the
/// rod's fixed frame unless a name says "body". Never part of a state.
struct Kinematics {
  RotationField R;
  VectorField l, n, m;                            // p'/L [1], force n L [N m], moment m [N m]
  VectorField k1, k2, l1, l2;                     // R dkappa/dt L, R d2kappa/dt2 L, R dlambda/dt, R d2lambda/dt2
  VectorField omega, alpha, omega_body, hdot;     // [1/s], [1/s2], [1/s]; dh/dt L [N m]
  VectorField velocity;                           // dp/dt / L [1/s]
  VectorField swing;                              // omega x p' + 2 R dlambda/dt, whose product with omega accelerates
  std::array<VectorField, kTcas> t, arm;          // tangent t_i of TCA i [1], its arm r_i x t_i / L [1]
  std::array<ScalarField, kTcas> inverse_length;  // 1/|u_i| [1]
  PerTca<double> path{};                          // int |u_i| ds / L [1]
  std::array<double, 4> tip_quaternion{1, 0, 0, 0};  // scalar first
  bool moving = false;                               // the last evaluation was one of dynamics
};

/// Where a loop writes the gradient of delta_i in the unknowns [m], one array per TCA.
using Gradients = std::array<double*, kTcas>;

/// Writes positions, velocities and the gradients b_i = d delta_i/dq = L int Phi^T [r_i x t_i; t_i] ds.
using KinematicsLoop = void (*)(const RodConstants&, const double* q, const double* v, Kinematics&, const Gradients& b);

/// Writes, for a rod at rest, the positions, the gradients b and the load's part of the residual,
/// r = -int Phi^T [R^T m; R^T n] ds.
using StaticsLoop = void (*)(const RodConstants&, const double* q, const Loads&, Kinematics&, double* r,
                             const Gradients& b);

/// The same for a moving rod; n and m then contain the inertia.
using DynamicsLoop = void (*)(const RodConstants&, const double* q, const double* v, const double* a, const Loads&,
                              Kinematics&, double* r, const Gradients& b);

/// Writes the derivative of r + sum N_i b_i at constant tensions N_i [N], column by column: weights[0] d/dq +
/// weights[1] d/dv + weights[2] d/da, at the point of the last evaluation.
using TangentLoop = void (*)(const RodConstants&, const Kinematics&, const std::array<double, 3>& weights,
                             const PerTca<double>& tension, double* J);

/// Writes the derivative of r in the direction (0, dv, da).
using RateLoop = void (*)(const RodConstants&, const Kinematics&, const double* dv, const double* da, double* dr);

struct ResidualLoops {
  KinematicsLoop kinematics = nullptr;
  StaticsLoop statics = nullptr;
  DynamicsLoop dynamics = nullptr;
};

struct TangentLoops {
  TangentLoop tangent = nullptr;
  RateLoop rate = nullptr;
};

ResidualLoops residual_loops(const RodConstants& rod);
TangentLoops tangent_loops(const RodConstants& rod);

}  // namespace rod
