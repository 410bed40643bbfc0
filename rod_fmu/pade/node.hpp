// The rod's equations at one grid point, discretised in time by backward Euler, with exact derivatives.
//   eta' = xi. - ad_xi eta                                                    (compatibility, Eq. 21)
//   W    = K (xi - xi*) + D xi. + sum N_i [r_i x t_i; t_i]                    (law; N_i tension)
//   W'   = ad_xi^T W - W_load + Gamma eta. - ad_eta^T Gamma eta               (balance, Eq. 23 with W_tot)
//   eps'_i. = t_i . u_i.                                                      (Eq. 22, its second row corrected)
// Units of this file: length L, force EA, time the step h, so that rates are differences: xi. = xi - xi_before.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "physics/data.hpp"

namespace rod::pade {

inline constexpr int tcas = static_cast<int>(tca_count);
inline constexpr int fields = 12;  // xi, eta

using Three = Eigen::Vector3d;
using Six = Eigen::Matrix<double, 6, 1>;
using Unknowns = Eigen::Matrix<double, fields, 1>;
using SixByAll = Eigen::Matrix<double, 6, fields>;
using SixByTca = Eigen::Matrix<double, 6, tcas>;
using PerTcaVector = Eigen::Matrix<double, tcas, 1>;

Eigen::Matrix3d hat(const Three& a);

/// What all points share.
struct Medium {
  Six stiffness, damping, inertia, reference;
  double mass = 0.0;  // of the length, which gravity pulls
};

/// A vector of the fixed frame seen from the body, b = exp(-w^) b_before, and its derivative in w.
struct Seen {
  Three value;
  Eigen::Matrix3d slope;
};
Seen seen(const Three& before, const Three& w);

/// What a point knows before the step.
struct Before {
  Unknowns z;
  Three gravity;  // seen from the body
  PerTcaVector stretch;
  std::array<Three, tca_count> r, r_slope;  // routing and its derivative
};

/// The equations at a point: values, derivatives in z = [xi; eta] and in the tensions.
struct Balance {
  Six eta_slope, W, W_slope;
  SixByAll eta_slope_z, W_z, W_slope_z;
  SixByTca W_N, W_slope_N;
  PerTcaVector stretch;  // eps'_i
  SixByTca stretch_xi;   // its derivative in xi, by column
};

void balance(const Medium& medium, const Before& before, const Unknowns& z, const PerTcaVector& N, Balance& out);

}  // namespace rod::pade
