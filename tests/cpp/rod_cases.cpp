// Cases of the field with known answers: curved reference, helical routing, buckling, frequencies, damping, nonlinear
// TCA law.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "rod_support.hpp"

using namespace rod;
using rod_test::bare_rod;
using rod_test::Bench;

namespace {

/// Natural frequencies [Hz], ascending, of small undamped motion about the bench's state at rest.
Eigen::VectorXd frequencies(Bench& bench) {
  bench.outputs();
  Matrix K, M;
  bench.rod.tangent(bench.scratch.newton.work, {.q = 1.0}, K);
  bench.rod.tangent(bench.scratch.newton.work, {.a = 1.0}, M);
  const Eigen::MatrixXd stiffness = K, mass = M;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(stiffness, mass);
  return solver.eigenvalues().cwiseMax(0.0).cwiseSqrt() / (2 * M_PI);
}

double nearest(const Eigen::VectorXd& values, double wanted) {
  double best = values[0];
  for (double each : values)
    if (std::abs(each - wanted) < std::abs(best - wanted)) best = each;
  return best;
}

}  // namespace

TEST(RodCases, FrequenciesOfTheBareRod) {
  Parameters p = bare_rod();
  p.set(&Segment::order, 7);
  Bench bench(p);
  const Eigen::VectorXd computed = frequencies(bench);
  for (double known : {5.0149, 26.471, 62.150, 37.1479, 21.4473})  // Timoshenko bending 1 to 3, axial, torsion
    EXPECT_NEAR(nearest(computed, known), known, 1e-4 * known);
}

TEST(RodCases, ColdActuatorsStiffenTheFirstMode) {
  const auto first = [](int order) {
    Parameters p;
    p.set(&Segment::order, order);
    Bench bench(p);
    return frequencies(bench)[0];
  };
  EXPECT_NEAR(first(5), first(7), 1e-4 * first(7));
  // Slender beams bound it: without TCAs, and with TCAs that resist every curvature as they do a uniform one.
  const Parameters p;
  const Section section = Section::of(p);
  const auto slender = [&](double EI) {
    return 3.516 * std::sqrt(EI / section.mass) / (p.length() * p.length()) / (2 * M_PI);
  };
  const double EI = section.stiffness[0];
  EXPECT_GT(first(7), 1.1 * slender(EI));
  EXPECT_LT(first(7), slender(EI + 1.5 * TcaLaw(p, 0).stiffness() * p.length() * p.tca[0].offset * p.tca[0].offset));
}

TEST(RodCases, UprightRodBucklesUnderItsOwnWeightAtTheKnownLoad) {
  Parameters p = bare_rod();
  p.set(&Segment::strains, Strains::bending);
  p.set(&Segment::order, 5);
  const Section section = Section::of(p);
  const auto softest = [&](double load) {
    Bench bench(p);
    bench.inputs.gravity[2][0] = -load * section.stiffness[0] / (section.mass * std::pow(p.length(), 3));
    bench.outputs();
    Matrix K;
    bench.rod.tangent(bench.scratch.newton.work, {.q = 1.0}, K);
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(Eigen::MatrixXd(K)).eigenvalues()[0];
  };
  EXPECT_GT(softest(0.999 * 7.837), 0.0);
  EXPECT_LT(softest(1.001 * 7.837), 0.0);
}

TEST(RodCases, BentCantileverOf45Degrees) {
  // Bathe and Bolourchi's arc of radius 100; tip positions by shooting. Its axes (tangent, inward, load) are ours (z,
  // x, y).
  constexpr double known[3][4] = {
      {300, 58.7789, 22.2447, 40.1924}, {450, 52.2383, 18.5081, 48.5035}, {600, 47.1501, 15.6847, 53.4755}};
  Parameters p = bare_rod();
  p.set(&Segment::length, 100.0 * M_PI / 4);
  p.set(&Segment::curvature, {0.0, 0.01, 0.0});
  p.profile = Profile::given;
  p.set(&Segment::stiffness, {1e7 / 12, 1e7 / 12, 5e6 / 6, 5e6 * 5 / 6, 5e6 * 5 / 6, 1e7});
  p.set(&Segment::order, 7);
  Bench bench(p);
  for (const auto& [load, x, y, z] : known) {
    bench.inputs.tip_force[1][0] = load;
    ASSERT_TRUE(bench.solve_equilibrium());
    const Outputs computed = bench.outputs();
    EXPECT_NEAR(computed.tip_p[2], x, 1e-4);
    EXPECT_NEAR(computed.tip_p[0], y, 1e-4);
    EXPECT_NEAR(computed.tip_p[1], z, 1e-4);
  }
}

TEST(RodCases, HelicalActuatorsTwistWithTheirHand) {
  for (double helix : {60.0, -60.0}) {
    Parameters p;
    p.set(&Tca::helix, helix);
    Bench bench(p);
    const double dT = 1e-3;
    for (auto& T : bench.inputs.T) T[0] += dT;
    ASSERT_TRUE(bench.solve_equilibrium());
    // N TCAs: W = 0 gives EA e = -N f/u, GJ kappa = -N f h r^2/u with f = k (L (e + h r^2 kappa)/u - s), u = sqrt(1 +
    // h^2 r^2).
    const Section section = Section::of(p);
    const TcaLaw law(p, 0);
    const double k = law.stiffness(), s = law.free_stroke(p.T_0 + dT), L = p.length(),
                 lever = helix * p.tca[0].offset * p.tca[0].offset;
    const double u2 = 1.0 + helix * helix * p.tca[0].offset * p.tca[0].offset, count = kTcas;
    const double f =
        -k * s / (1.0 + count * k * L / u2 * (1.0 / section.stiffness[5] + lever * lever / section.stiffness[2]));
    const double twist = -count * f * lever / std::sqrt(u2) / section.stiffness[2];
    EXPECT_NEAR(bench.state.q[2] / L, twist, 1e-4 * std::abs(twist));
    EXPECT_GT(bench.state.q[2] * helix, 0.0) << "a pushing TCA lengthens by winding further";
  }
}

TEST(RodCases, ContractionActuatorsBendTheOtherWay) {
  Parameters p;
  Bench extension(p);
  p.set(&Tca::chirality, -1);
  Bench contraction(p);
  for (Bench* bench : {&extension, &contraction}) {
    bench->inputs.T[0][0] += 20.0;
    ASSERT_TRUE(bench->solve_equilibrium());
  }
  EXPECT_LT(extension.outputs().tip_p[0], 0.0);
  EXPECT_GT(contraction.outputs().tip_p[0], 0.0);
}

TEST(RodCases, TwistingOfTheRoutingTurnsTheAnswerOnly) {
  Parameters p;
  Bench plain(p);
  const double turn = 0.7;
  for (Tca& tca : p.tca) tca.azimuth += turn;
  Bench turned(p);
  for (Bench* bench : {&plain, &turned}) {
    bench->inputs.T[0][0] += 30.0;
    ASSERT_TRUE(bench->solve_equilibrium());
  }
  const Triple a = plain.outputs().tip_p, b = turned.outputs().tip_p;
  EXPECT_NEAR(b[0], std::cos(turn) * a[0] - std::sin(turn) * a[1], 1e-12);
  EXPECT_NEAR(b[1], std::sin(turn) * a[0] + std::cos(turn) * a[1], 1e-12);
  EXPECT_NEAR(b[2], a[2], 1e-12);
}

TEST(RodCases, DampingRateOfTheFirstMode) {
  Parameters p = bare_rod();
  p.set(&Segment::order, 3);
  p.set(&Segment::retardation, 1e-3);
  Bench bench(p);
  const double omega = 2 * M_PI * frequencies(bench)[0];
  bench.inputs.tip_force[0][0] = 1e-6;
  ASSERT_TRUE(bench.solve_equilibrium());
  bench.inputs.tip_force[0][0] = 0.0;
  const double period = 2 * M_PI / (omega * std::sqrt(1.0 - std::pow(0.5 * p.segment[0].retardation * omega, 2)));
  const auto after_periods = [&](int count) {
    EXPECT_EQ(step_rosenbrock(bench.rod, bench.inputs, count * period, 1e-7, bench.state, bench.scratch).reached,
              count * period);
    return bench.outputs().tip_p[0];
  };
  const double early = after_periods(2), late = after_periods(3);  // by then higher modes are gone
  const double rate = std::log(early / late) / (3 * period);
  EXPECT_NEAR(rate, 0.5 * p.segment[0].retardation * omega * omega, 0.01 * rate);
}

TEST(RodCases, CurrentPitchIsTheFrozenLawForSmallDisplacements) {
  Parameters p;
  const TcaLaw frozen(p, 0);
  p.set(&Tca::pitch, Pitch::current);
  const TcaLaw current(p, 0);
  const double T = 340.0, e = 1e-6;
  EXPECT_EQ(current.stiffness(), frozen.stiffness());
  EXPECT_NEAR(current.tension(0.0, T).value, frozen.tension(0.0, T).value, 1e-12);
  const double delta = 8e-3;
  const Tension N = current.tension(delta, T);
  EXPECT_GT(std::abs(N.value - frozen.tension(delta, T).value), 1e-3) << "large displacements change the pitch";
  EXPECT_NEAR((current.tension(delta + e, T).value - current.tension(delta - e, T).value) / (2 * e), N.per_delta,
              1e-6 * std::abs(N.per_delta));
  EXPECT_NEAR((current.energy(delta + e, T) - current.energy(delta - e, T)) / (2 * e), N.value,
              1e-7 * std::abs(N.value));
  EXPECT_TRUE(std::isnan(current.tension(0.2, T).value)) << "a wire of 0.13 m does not reach that far";

  Bench bench(p);
  bench.inputs.T[0][0] = 350.0;
  ASSERT_TRUE(bench.solve_equilibrium());
  bench.outputs();
  EXPECT_GT(bench.scratch.newton.work.delta[0], 1e-3);
}
