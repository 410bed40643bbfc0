// Equations of one grid point; see the header for the symbols.
#include "pade/node.hpp"

#include <cmath>

namespace rod::pade {

Eigen::Matrix3d hat(const Vector3& a) {
  Eigen::Matrix3d m;
  m << 0.0, -a[2], a[1], a[2], 0.0, -a[0], -a[1], a[0], 0.0;
  return m;
}

BodyFrameVector in_body_frame(const Vector3& before, const Vector3& w) {
  // (1 - cos x)/x^2, sin(x)/x and (x - sin x)/x^3; their series where differences would cancel.
  const double square = w.squaredNorm(), x = std::sqrt(square);
  const bool small = x < 1e-2;
  const double sinc = small ? 1.0 - square / 6.0 * (1.0 - square / 20.0) : std::sin(x) / x;
  const double versine = small ? 0.5 - square / 24.0 * (1.0 - square / 30.0) : (1.0 - std::cos(x)) / square;
  const double rest = small ? 1.0 / 6.0 - square / 120.0 * (1.0 - square / 42.0) : (1.0 - sinc) / square;
  const Eigen::Matrix3d turn = hat(w), turn_2 = turn * turn;
  const Vector3 value = before - sinc * (turn * before) + versine * (turn_2 * before);
  return {value, hat(value) * (Eigen::Matrix3d::Identity() - versine * turn + rest * turn_2)};
}

namespace {

/// Adds the TCAs to W and its derivatives, and integrates eps' over the step (Eq. 22, second row).
void add_actuators(const PreviousNode& before, const NodeVector& z, const TcaVector& N, NodeEquations& out) {
  const Vector3 kappa = z.segment<3>(0), lambda = z.segment<3>(3);
  const Vector3 kappa_before = before.z.segment<3>(0), lambda_before = before.z.segment<3>(3);
  for (int i = 0; i < static_cast<int>(N.size()); ++i) {
    const Vector3& r = before.r[i];
    const Vector3 u = lambda + kappa.cross(r) + before.r_slope[i];
    const Vector3 change = u - (lambda_before + kappa_before.cross(r) + before.r_slope[i]);
    const double length = u.norm();
    const Vector3 t = u / length;
    const Eigen::Matrix3d normal = (Eigen::Matrix3d::Identity() - t * t.transpose()) / length;
    Eigen::Matrix<double, 6, 3> arm;  // transpose of du/dxi
    arm << hat(r), Eigen::Matrix3d::Identity();
    out.W_N.col(i) = arm * t;
    out.W += N[i] * out.W_N.col(i);
    out.W_z.leftCols<6>() += N[i] * (arm * normal * arm.transpose());
    out.stretch[i] = before.stretch[i] + t.dot(change);
    out.stretch_xi.col(i) = arm * (t + normal * change);
  }
}

}  // namespace

void node_equations(const ScaledSection& section, const PreviousNode& before, const NodeVector& z, const TcaVector& N,
                    NodeEquations& out) {
  const Vector3 kappa = z.segment<3>(0), lambda = z.segment<3>(3), w = z.segment<3>(6), v = z.segment<3>(9);
  const NodeVector change = z - before.z;
  out.resize(static_cast<int>(N.size()));
  const Eigen::Matrix3d K = hat(kappa), Lambda = hat(lambda), Omega = hat(w);

  // Compatibility (Eq. 21).
  out.eta_slope = change.head<6>();
  out.eta_slope.head<3>() -= kappa.cross(w);
  out.eta_slope.tail<3>() -= lambda.cross(w) + kappa.cross(v);
  out.eta_slope_z.setZero();
  out.eta_slope_z.leftCols<6>().setIdentity();
  out.eta_slope_z.block<3, 3>(0, 0) += Omega;
  out.eta_slope_z.block<3, 3>(3, 0) = hat(v);
  out.eta_slope_z.block<3, 3>(3, 3) += Omega;
  out.eta_slope_z.block<3, 3>(0, 6) = -K;
  out.eta_slope_z.block<3, 3>(3, 6) = -Lambda;
  out.eta_slope_z.block<3, 3>(3, 9) = -K;

  // Law of the section (Eqs. 9-13).
  out.W =
      section.stiffness.cwiseProduct(z.head<6>() - section.reference) + section.damping.cwiseProduct(change.head<6>());
  out.W_z.setZero();
  out.W_z.leftCols<6>().diagonal() = section.stiffness + section.damping;
  add_actuators(before, z, N, out);

  // Balance of momentum (Eq. 23): m' = -kappa x m - lambda x n + J w. + w x J w,  n' = -kappa x n - weight + mass (v. +
  // w x v).
  const Vector3 m = out.W.head<3>(), n = out.W.tail<3>(), J = section.inertia.head<3>(),
                mass = section.inertia.tail<3>();
  const Vector3 spin = J.cwiseProduct(w), momentum = mass.cwiseProduct(v);
  const BodyFrameVector weight = in_body_frame(before.gravity, w);
  out.W_slope.head<3>() = J.cwiseProduct(change.segment<3>(6)) + w.cross(spin) - kappa.cross(m) - lambda.cross(n);
  out.W_slope.tail<3>() =
      mass.cwiseProduct(change.segment<3>(9)) + w.cross(momentum) - kappa.cross(n) - section.mass * weight.value;

  const auto transport = [&](const auto& dW, auto&& dslope) {
    dslope.template topRows<3>() = -K * dW.template topRows<3>() - Lambda * dW.template bottomRows<3>();
    dslope.template bottomRows<3>() = -K * dW.template bottomRows<3>();
  };
  transport(out.W_N, out.W_slope_N);
  transport(out.W_z, out.W_slope_z);
  out.W_slope_z.block<3, 3>(0, 0) += hat(m);
  out.W_slope_z.block<3, 3>(0, 3) += hat(n);
  out.W_slope_z.block<3, 3>(3, 0) += hat(n);
  out.W_slope_z.block<3, 3>(0, 6) += Omega * J.asDiagonal() - hat(spin);
  out.W_slope_z.block<3, 3>(0, 6).diagonal() += J;
  out.W_slope_z.block<3, 3>(3, 6) -= section.mass * weight.slope + hat(momentum);
  out.W_slope_z.block<3, 3>(3, 9) += Omega * mass.asDiagonal();
  out.W_slope_z.block<3, 3>(3, 9).diagonal() += mass;
}

}  // namespace rod::pade
