// The parts of the rod one by one: quadrature, rotations, TCA law.
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "mechanics/rotations.hpp"
#include "numerics/packed_lu.hpp"
#include "numerics/quadrature.hpp"
#include "physics/tca_law.hpp"
#include "rod_support.hpp"

using namespace rod;
using rod_test::Bench;
using rod_test::RandomState;

class RodQuadrature : public testing::TestWithParam<int> {
 protected:
  const Quadrature& grid = quadrature(GetParam());
  const int nodes = grid.nodes;
};

TEST_P(RodQuadrature, IntegratesPolynomialsExactly) {
  for (int degree = 0; degree < nodes; ++degree)
    for (int k = 0; k < nodes; ++k) {
      double sum = 0.0;
      for (int j = 0; j < nodes; ++j) sum += grid.forward[j][k] * std::pow(grid.s[j], degree);
      EXPECT_NEAR(sum, std::pow(grid.s[k], degree + 1) / (degree + 1), 1e-15);
    }
  for (int degree = 0; degree < 2 * nodes; ++degree) {
    double sum = 0.0;
    for (int k = 0; k < nodes; ++k) sum += grid.w[k] * std::pow(grid.s[k], degree);
    EXPECT_NEAR(sum, 1.0 / (degree + 1), 1e-15);
  }
}

TEST_P(RodQuadrature, KnowsThePolynomialsIntegrals) {
  for (int a = 0; a < kMaxTerms; ++a)
    for (int k = 0; k < nodes; ++k) {
      double sum = 0.0;
      for (int j = 0; j < nodes; ++j) sum += grid.forward[j][k] * grid.legendre[a][j];
      EXPECT_NEAR(grid.legendre_integral[a][k], sum, 1e-15);
    }
}

TEST_P(RodQuadrature, StationsEndAtTheTip) {
  for (int j = 0; j < nodes; ++j) {
    EXPECT_NEAR(grid.stations[j][0], 0.0, 1e-15);
    EXPECT_NEAR(grid.stations[j][kShapeStations - 1], grid.w[j], 1e-15);
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, RodQuadrature, testing::Values(3, 4, 7));

namespace {

/// Curvature k(s) = c0 + c1 s + c2 s^2 per component, as rotate_along wants it.
IntervalCurvature sample(const Quadrature& grid, const double (&c)[3][3]) {
  IntervalCurvature kappa;
  double from = 0.0;
  for (int e = 0; e < grid.intervals; ++e) {
    for (int g = 0; g < kGaussPoints; ++g) {
      const double s = from + grid.length[e] * (0.5 + 0.5 * std::sqrt(0.6) * (g - 1));
      for (int axis = 0; axis < 3; ++axis) kappa[g][axis][e] = c[axis][0] + s * (c[axis][1] + s * c[axis][2]);
    }
    from += grid.length[e];
  }
  return kappa;
}

/// The tip's quaternion by many midpoint rotations, Richardson-extrapolated: independent of the Magnus expansion.
std::array<double, 4> fine_tip(const double (&c)[3][3], int pieces) {
  std::array<double, 4> q{1, 0, 0, 0};
  for (int i = 0; i < pieces; ++i) {
    const double h = 1.0 / pieces, s = (i + 0.5) * h;
    double k[3], square = 0.0;
    for (int axis = 0; axis < 3; ++axis)
      k[axis] = h * (c[axis][0] + s * (c[axis][1] + s * c[axis][2])), square += k[axis] * k[axis];
    const double angle = std::sqrt(square), f = std::sin(0.5 * angle) / angle, w = std::cos(0.5 * angle);
    const double x = f * k[0], y = f * k[1], z = f * k[2];
    q = {q[0] * w - q[1] * x - q[2] * y - q[3] * z, q[0] * x + q[1] * w + q[2] * z - q[3] * y,
         q[0] * y - q[1] * z + q[2] * w + q[3] * x, q[0] * z + q[1] * y - q[2] * x + q[3] * w};
  }
  return q;
}

}  // namespace

TEST(RodRotations, ConstantCurvatureIsAnArcForAnyAngle) {
  for (double angle : {0.1, 3.0, 12.0, 80.0}) {  // 80 rad needs the wide turns
    const double c[3][3] = {{angle, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    for (int order : {3, 4, 7}) {
      const Quadrature& grid = quadrature(order);
      RotationField R;
      const auto tip = rotate_along(grid, sample(grid, c), R);
      EXPECT_NEAR(std::abs(tip[0]), std::abs(std::cos(0.5 * angle)), 1e-13 * (1 + angle));
      for (int k = 0; k < grid.nodes; ++k)
        EXPECT_NEAR(R.row1.at(k).y, std::cos(angle * grid.s[k]), 1e-13 * (1 + angle));
    }
  }
}

TEST(RodRotations, AgreesWithManySmallTurns) {
  const double c[3][3] = {{2.0, -3.0, 1.0}, {-1.0, 2.5, 2.0}, {0.5, 1.0, -3.0}};
  const Quadrature& grid = quadrature(4);
  RotationField R;
  const auto tip = rotate_along(grid, sample(grid, c), R);
  const auto coarse = fine_tip(c, 2000), fine = fine_tip(c, 4000);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(tip[i], fine[i] + (fine[i] - coarse[i]) / 3.0, 1e-10);
}

TEST(RodRotations, TurnsInAPlaneByAnyAngle) {
  for (double widest : {0.1, 3.9, 50.0}) {  // the last one by one
    ScalarField angle;
    for (int k = 0; k < 12; ++k) angle[k] = widest * (k - 5) / 6.0;
    RotationField R;
    rotate_in_plane<3>(angle, R);
    for (int k = 0; k < 12; ++k) {
      const double c = std::cos(angle[k]), s = std::sin(angle[k]);
      const Vec3 x = R.row0.at(k), y = R.row1.at(k), z = R.row2.at(k);
      for (double error : {x.x - c, x.y, x.z - s, y.x, y.y - 1.0, y.z, z.x + s, z.y, z.z - c})
        EXPECT_NEAR(error, 0.0, 5e-15);
    }
  }
}

TEST(RodTca, LawOfTheDefaultSet) {
  const Parameters p;
  const TcaLaw law(p, 0);
  EXPECT_NEAR(law.stiffness(), 79.5378, 1e-4);
  EXPECT_NEAR(law.free_stroke(p.T_0 + 40.0), 7.95322e-3, 1e-8);
  EXPECT_EQ(law.tension(0.0, p.T_0).value, 0.0);
  EXPECT_LT(law.tension(0.0, p.T_0 + 40.0).value, 0.0) << "a hot extension TCA pushes";
}

TEST(RodTca, ChiralityReversesTheStroke) {
  Parameters p;
  p.set(&Tca::chirality, -1);
  EXPECT_LT(TcaLaw(p, 0).free_stroke(p.T_0 + 40.0), 0.0);
}

TEST(RodTca, TensionIsTheSlopeOfItsEnergy) {
  for (Law kind : {Law::wire, Law::measured}) {
    Parameters p;
    p.set(&Tca::law, kind);
    const TcaLaw law(p, 0);
    const double delta = 2e-3, T = 330.0, e = 1e-6, eT = 1e-3;
    const Tension N = law.tension(delta, T);
    EXPECT_NEAR((law.energy(delta + e, T) - law.energy(delta - e, T)) / (2 * e), N.value, 1e-8 * std::abs(N.value));
    EXPECT_NEAR((law.tension(delta, T + eT).value - law.tension(delta, T - eT).value) / (2 * eT), N.per_T,
                1e-8 * std::abs(N.per_T));
  }
}

TEST(RodParts, OutputsOfALookAreThoseBehindTheResidual) {
  for (bool planar : {false, true}) {
    Parameters p;
    p.planar = planar;
    Bench bench(p);
    bench.inputs.gravity[0][0] = 9.81;
    bench.inputs.T[0][0] = 340.0;
    const RandomState x(bench.rod.unknowns(), 7);
    bench.state.q = x.q, bench.state.v = x.v, bench.state.a = x.a;
    const Outputs whole = bench.outputs();
    Outputs y;
    Workspace work;
    const Loads loads = loads_at(bench.inputs, 0.0);
    bench.rod.kinematics(x.q.data(), x.v.data(), loads, work);
    bench.rod.outputs(x.q.data(), x.v.data(), loads, work, y);
    EXPECT_EQ(y.shape, whole.shape);
    EXPECT_EQ(y.tip_v, whole.tip_v);
    EXPECT_EQ(y.delta_rate, whole.delta_rate);
    EXPECT_EQ(y.N, whole.N);
    EXPECT_EQ(std::tuple(y.energy_kinetic, y.energy_gravity, y.energy_tca, y.out_of_plane),
              std::tuple(whole.energy_kinetic, whole.energy_gravity, whole.energy_tca, whole.out_of_plane));
  }
}

TEST(RodTca, ContactOfTheCoilsDerivesFromAPotential) {
  Parameters p;
  p.set(&Tca::law, Law::measured), p.set(&Tca::stiffening, 400.0), p.set(&Tca::stroke_curvature, 1e-6);
  p.set(&Tca::stop, -5e-3), p.set(&Tca::stop_width, 2e-3), p.set(&Tca::stop_stiffness, 300.0);
  const TcaLaw law(p, 0);
  for (double delta : {-12e-3, -7e-3, -6e-3, -4.5e-3, -2e-3, 5e-3}) {
    const double T = 330.0, e = 1e-6;
    const Tension N = law.tension(delta, T), ahead = law.tension(delta + e, T), behind = law.tension(delta - e, T);
    EXPECT_NEAR((law.energy(delta + e, T) - law.energy(delta - e, T)) / (2 * e), N.value, 1e-7) << delta;
    EXPECT_NEAR((ahead.value - behind.value) / (2 * e), N.per_delta, 1e-5 * N.per_delta) << delta;
    const double eT = 1e-3;
    EXPECT_NEAR((law.tension(delta, T + eT).value - law.tension(delta, T - eT).value) / (2 * eT), N.per_T, 1e-7)
        << delta;
  }
  p.set(&Tca::stop_stiffness, 0.0);
  EXPECT_EQ(TcaLaw(p, 0).tension(-1e-3, 330.0).value, law.tension(-1e-3, 330.0).value) << "one-sided";
}

TEST(RodTca, MeasuredLawFitsMeasuredLengths) {
  // Type 1-180 of Sun et al., Soft Robotics 8(2), 2021, Fig. 4: lengths under 0 to 50 g, 30 to 148 degC, read to +-0.7
  // mm. One set of parameters for all loads and temperatures.
  Parameters p;
  p.T_0 = 303.15;
  p.set(&Tca::law, Law::measured), p.set(&Tca::chirality, -1);
  p.set(&Tca::stiffness, 2.506), p.set(&Tca::stiffening, 148.0);
  p.set(&Tca::stroke, 1.499e-4), p.set(&Tca::stroke_curvature, 1.775e-6);
  p.set(&Tca::stop, -12.6e-3), p.set(&Tca::stop_width, 6e-3), p.set(&Tca::stop_stiffness, 30.3);
  const TcaLaw law(p, 0);
  const double length = 88.29e-3;  // without load at T_0
  double sum = 0.0, largest = 0.0;
  int count = 0;
  for (const std::vector<double>& row : rod_test::read_csv("tca_length_over_temperature.csv"))
    for (int column = 1; column <= 6; ++column) {
      if (row[column] == 0.0) continue;  // not measured
      const double load = (60.0 - 10.0 * column) * 1e-3 * 9.81, T = row[0] + 273.15;
      double low = law.free_stroke(T) - 5e-3, high = 0.1;
      for (int i = 0; i < 60; ++i) (law.tension(0.5 * (low + high), T).value < load ? low : high) = 0.5 * (low + high);
      const double error = length + low - 1e-3 * row[column];
      sum += error * error, largest = std::max(largest, std::abs(error)), ++count;
    }
  EXPECT_GT(count, 70);
  EXPECT_LT(std::sqrt(sum / count), 0.7e-3);
  EXPECT_LT(largest, 2.5e-3);
}

TEST(PackedLu, SolvesSystemsOfAllSizesInTurn) {
  PackedLu lu;
  std::srand(1);
  for (const int n : {1, 2, 3, 4, 5, 9, 12, 21, 48, 7}) {
    const Matrix A = Matrix::Random(n, n);  // rows must be swapped: diagonals near 0 are among them
    const Vector b = Vector::Random(n);
    Vector x = b;
    lu.compute(A);
    lu.solve(x, x);
    const double scale = A.cwiseAbs().sum() * x.lpNorm<Eigen::Infinity>();
    EXPECT_LE((A * x - b).lpNorm<Eigen::Infinity>(), 1e-15 * scale) << n;
  }
}
