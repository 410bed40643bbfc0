// The loops over nodes, for motion in space and in a plane and for every number of nodes: what they need to know of a
// rod, and what they leave behind.
#pragma once

#include <array>

#include "numerics/field.hpp"
#include "numerics/quadrature.hpp"
#include "physics/data.hpp"
#include "physics/loads.hpp"

namespace rod {

/// Constants of one rod, in its frame; mass [kg/m], inertia [kg m], curvatures times L, offsets over L.
struct Build {
  const Quadrature* grid = nullptr;
  bool planar = false;
  double length = 0.0;
  double mass = 0.0;
  Vec3 inertia;
  Vec3 kappa, lambda{0.0, 0.0, 1.0};  // unloaded
  int terms = 0;                      // degrees of the strains
  int count = 0;                      // components of the strains, the first of:
  std::array<int, 6> components{};
  std::array<Field, tca_count> offset, slope;  // r_i/L and dr_i/ds at the nodes

  int unknowns() const { return terms * count; }
};

/// Scratch of one evaluation: what the residual leaves for derivatives and outputs. Never part of a state.
struct Kinematics {
  RotationField R;
  Field l, n, m;                         // p'/L, force n L, moment m
  Field k1, k2, l1, l2;                  // R kappa. L, R kappa.. L, R lambda., R lambda..
  Field omega, alpha, omega_body, hdot;  // hdot scaled by L
  Field velocity, swing;                 // over L; what turns with omega in the acceleration,
                                         // omega x p' + 2 R lambda.
  std::array<Field, tca_count> t,
      arm;                                     // tangent of TCA i, its arm r_i x t_i over L
  std::array<Lane, tca_count> inverse_length;  // 1/|u_i|
  PerTca<double> path{};                       // int |u_i| ds/L
  std::array<double, 4> tip_quaternion{1, 0, 0, 0};
  bool moving = false;
};

/// Writes minus the moments of [R^T m; R^T n] into r, and those of [r_i x t_i; t_i] L into b[i]. Statics when v and a
/// are null; positions and velocities alone, and b, when r and a are.
using ResidualLoop = void (*)(const Build&, const double* q, const double* v, const double* a, const Loads&,
                              Kinematics&, double* r, const std::array<double*, tca_count>& b);
ResidualLoop residual_loop(const Build& build);

/// Writes the variation of that r, with the tensions `pull` [N] following the TCAs' directions, column by column:
/// weights of the derivatives in q, v, a.
using TangentLoop = void (*)(const Build&, const Kinematics&, const std::array<double, 3>& weights,
                             const PerTca<double>& pull, double* J);
TangentLoop tangent_loop(const Build& build);

/// The same in the one direction (0, dv, da).
using RateLoop = void (*)(const Build&, const Kinematics&, const double* dv, const double* da, double* dr);
RateLoop rate_loop(const Build& build);

}  // namespace rod
