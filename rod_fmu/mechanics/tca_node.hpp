// A TCA at one node of a segment, and the changes between packs' triads and Eigen's vectors.
#pragma once

#include <Eigen/Core>

#include "mechanics/loops.hpp"
#include "mechanics/rod.hpp"

namespace rod {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector12 = Eigen::Matrix<double, 12, 1>;

inline Eigen::Vector3d dense(const Vec3& a) { return {a.x, a.y, a.z}; }
inline Vec3 triad(const Eigen::Vector3d& a) { return {a[0], a[1], a[2]}; }

inline Vector6 dense(const Wrench& w) { return (Vector6() << dense(w.force), dense(w.moment)).finished(); }
inline Wrench wrench(const Vector6& a) { return {triad(a.head<3>()), triad(a.tail<3>())}; }
inline Vector12 dense(const SectionVariation& d) {
  return (Vector12() << dense(d.theta), dense(d.omega), dense(d.alpha), dense(d.a)).finished();
}
inline SectionVariation variation(const Vector12& a) {
  return {triad(a.segment<3>(0)), triad(a.segment<3>(3)), triad(a.segment<3>(6)), triad(a.segment<3>(9))};
}

/// The strain of a TCA at a node: du = D e for a variation e of the section's strains in units of the unknowns.
struct TcaNode {
  Eigen::Matrix<double, 3, 6> D;
  Eigen::Vector3d t, kappa;  // direction; curvature times length
  double inverse_length;     // 1/|u|
};

inline TcaNode tca_node(const RodConstants& segment, const SegmentWorkspace& w, std::size_t i, int k) {
  const Vec3 r = segment.offset[i].at(k);
  TcaNode node;
  node.D << 0.0, r.z, -r.y, 1.0, 0.0, 0.0,  //
      -r.z, 0.0, r.x, 0.0, 1.0, 0.0,        //
      r.y, -r.x, 0.0, 0.0, 0.0, 1.0;
  node.t = dense(w.t[i].at(k));
  node.kappa = dense(w.kappa.at(k));
  node.inverse_length = w.inverse_length[i][k];
  return node;
}

/// Gradient of kappa . t in e.
inline Vector6 twist_gradient(const TcaNode& node) {
  const Eigen::Vector3d across = node.kappa - node.t * node.t.dot(node.kappa);
  Vector6 gradient = node.inverse_length * node.D.transpose() * across;
  gradient.head<3>() += node.t;
  return gradient;
}

}  // namespace rod
