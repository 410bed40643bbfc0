// One TCA at the centre, where the problem depends on the radius alone: closed steady state, fine one-dimensional
// transient.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <numbers>

#include "mesh/spectral.hpp"
#include "thermal_scene.hpp"

namespace thermal {
namespace {

constexpr double kPi = std::numbers::pi;

Parameters centred() {
  Parameters p(1);
  p.tca.offset[0] = 0.0;
  p.tca.k[0] = 4.6;
  p.tolerance = 1e-7;
  return p;
}

/// Mean rise over the annulus per watt, steady: logarithms through the body, the annulus with its source and insulated
/// bore.
double steady_rise(const Parameters& p) {
  const double a = p.tca.inner_radius[0], b = p.tca.outer_radius[0], R = p.body.radius, L = p.body.length;
  const double area = kPi * (b * b - a * a), q = 1.0 / (L * area);
  const double surface = 1.0 / (p.h * 2.0 * kPi * R * L);
  const double body = std::log(R / b) / (2.0 * kPi * p.body.k * L);
  // T(r) - T(b) = q (b^2 - r^2)/(4 k) + q a^2/(2 k) ln(r/b), its mean over a < r < b
  const double squares = std::pow(b * b - a * a, 2) / 4.0;
  const double logarithm = -b * b / 4.0 - a * a / 2.0 * std::log(a / b) + a * a / 4.0;
  const double annulus =
      2.0 / (b * b - a * a) * (q / (4.0 * p.tca.k[0]) * squares + q * a * a / (2.0 * p.tca.k[0]) * logarithm);
  return surface + body + annulus;
}

/// Mean rise over the annulus at time t for one watt: radial elements of order 24, all modes.
double radial_rise(const Parameters& p, double t) {
  const LobattoRule rule = lobatto_rule(24);
  const Eigen::Index n = rule.nodes.size();
  const std::array<double, 7> ends{
      p.tca.inner_radius[0],       0.6 * p.tca.outer_radius[0], p.tca.outer_radius[0], 1.3 * p.tca.outer_radius[0],
      2.0 * p.tca.outer_radius[0], 0.7 * p.body.radius,         p.body.radius};
  const Eigen::Index elements = ends.size() - 1, size = elements * (n - 1) + 1;
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(size), mean = Eigen::VectorXd::Zero(size);
  Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index e = 0; e < elements; ++e) {
    const bool is_tca = ends[e + 1] <= p.tca.outer_radius[0];
    const double half = 0.5 * (ends[e + 1] - ends[e]), k = is_tca ? p.tca.k[0] : p.body.k;
    const Eigen::VectorXd ring = 2.0 * kPi * p.body.length * half *
                                 rule.weights.cwiseProduct((ends[e] + half * (1.0 + rule.nodes.array())).matrix());
    const Eigen::Index first = e * (n - 1);
    mass.segment(first, n) += (is_tca ? p.tca.rho_c[0] : p.body.rho_c) * ring;
    if (is_tca) mean.segment(first, n) += ring;
    stiffness.block(first, first, n, n) +=
        k / (half * half) * rule.derivative.transpose() * ring.asDiagonal() * rule.derivative;
  }
  mean /= mean.sum();
  stiffness(size - 1, size - 1) += p.h * 2.0 * kPi * p.body.radius * p.body.length;
  const Eigen::VectorXd root = mass.cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      Eigen::MatrixXd(root.asDiagonal() * stiffness * root.asDiagonal()));
  const Eigen::ArrayXd load = (eigen.eigenvectors().transpose() * root.cwiseProduct(mean)).array();
  const Eigen::ArrayXd rate = eigen.eigenvalues().array();
  return (load.square() * -(-rate * t).expm1() / rate).sum();
}

double rise(const Parameters& p, double t) {
  Trajectory run = run_of(p);
  Drive drive;
  drive.V[0][0] = std::sqrt(p.tca.R[0]);
  run.advance(drive, t);
  return run.observe(drive).rise[0];
}

TEST(Centred, SteadyStateIsTheClosedForm) {
  EXPECT_NEAR(radial_rise(centred(), 1e6) / steady_rise(centred()), 1.0, 1e-9);
  EXPECT_NEAR(rise(centred(), 1e6) / steady_rise(centred()), 1.0, 1e-6);
}

TEST(Centred, TransientIsThatOfTheRadialProblem) {
  const Parameters p = centred();
  for (double t : {0.01, 0.1, 1.0, 10.0, 100.0, 1000.0}) {
    EXPECT_NEAR(rise(p, t), radial_rise(p, t), 1e-6 * steady_rise(p)) << "t = " << t;
    if (t >= 0.1) {
      EXPECT_NEAR(rise(p, t) / radial_rise(p, t), 1.0, 1e-6) << "t = " << t;
    }
  }
}

TEST(Centred, OffTheCentreTheOuterWallIsNearer) {
  Parameters off = centred();
  off.tca.offset[0] = 3.9e-3;  // a wall of a quarter of a millimetre
  const double near_wall = rise(off, 1e5), in_the_middle = rise(centred(), 1e5);
  EXPECT_GT(near_wall, in_the_middle);  // with weak cooling the way through the body counts
  off.h = 1e4;
  Parameters middle = centred();
  middle.h = 1e4;
  EXPECT_LT(rise(off, 1e5), rise(middle, 1e5));
}

}  // namespace
}  // namespace thermal
