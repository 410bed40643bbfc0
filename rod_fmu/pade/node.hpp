// Equations of the rod at one grid point, discretised in time by backward Euler (Eq. 24), with exact derivatives.
//   eta'  = dxi/dt - ad_xi eta                                       compatibility (Eq. 21)
//   W     = K (xi - xi*) + D dxi/dt + sum N_i [r_i x t_i; t_i]       law of section and TCAs (Eqs. 9-14), N_i tension
//   W'    = ad_xi^T W - W_load + Gamma deta/dt - ad_eta^T Gamma eta  balance (Eq. 23 for the total wrench, corrected)
//   deps'_i/dt = t_i . du_i/dt                                       stretch of TCA i (Eq. 22, second row corrected)
// Units of this room: length L, force EA, time the step h, so that rates are differences: dxi/dt = xi - xi_before.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "physics/data.hpp"

namespace rod::pade {

inline constexpr int kFields = 12;  // xi, eta

using Vector3 = Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using NodeVector = Eigen::Matrix<double, kFields, 1>;
using Matrix6xNode = Eigen::Matrix<double, 6, kFields>;
// One column, or one number, per TCA.
using Matrix6xTca = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, kMaxTcas>;
using TcaVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxTcas, 1>;

Eigen::Matrix3d hat(const Vector3& a);

/// Section in the units of one step, the same at all points.
struct ScaledSection {
  Vector6 stiffness, damping, inertia, reference;
  double mass = 0.0;  // of the whole rod, which gravity acts on
};

/// A constant vector of the fixed frame in the body frame after the rotation w of a step, exp(-w^) before, and its
/// derivative in w.
struct BodyFrameVector {
  Vector3 value;
  Eigen::Matrix3d slope;
};
BodyFrameVector in_body_frame(const Vector3& before, const Vector3& w);

/// A point at the start of the step.
struct PreviousNode {
  NodeVector z;
  Vector3 gravity;  // in the body frame
  TcaVector stretch;
  std::array<Vector3, kMaxTcas> r, r_slope;  // routing and its derivative
};

/// Values of the equations at a point, and their derivatives in z = [xi; eta] and in the tensions.
struct NodeEquations {
  Vector6 eta_slope, W, W_slope;
  Matrix6xNode eta_slope_z, W_z, W_slope_z;
  Matrix6xTca W_N, W_slope_N;
  TcaVector stretch;       // eps'_i
  Matrix6xTca stretch_xi;  // its derivative in xi, by column

  /// Makes room for this number of TCAs.
  void resize(int tcas) {
    W_N.resize(6, tcas), W_slope_N.resize(6, tcas), stretch_xi.resize(6, tcas);
    stretch.resize(tcas);
  }
};

void node_equations(const ScaledSection& section, const PreviousNode& before, const NodeVector& z, const TcaVector& N,
                    NodeEquations& out);

}  // namespace rod::pade
