// The paper's scheme on a grid: its parts, its orders, agreement with the strain polynomials and with independent
// numbers, balances, and what it does when Newton's method fails.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "pade.hpp"
#include "probe/host.hpp"
#include "rod_support.hpp"

using namespace rod;
using pade::tcas;
using rod_test::bare_rod;
using rod_test::Bench;

namespace {

struct GridBench {
  GridBench(const Parameters& p, int points)
      : parameters(p),
        rod(p, Section::of(p), points),
        memory(GridState::size(points)),
        state(memory.data(), points),
        scratch(rod.scratch()) {
    rod.straighten(state);
  }

  Outputs look() {
    Outputs y;
    rod.outputs(loads_at(inputs, 0.0), state, y);
    return y;
  }
  bool settle() { return rod.settle(loads_at(inputs, 0.0), state, scratch); }
  void step(double h) { ASSERT_EQ(rod.step(inputs, h, state, scratch).reached, h); }

  /// u_i = lambda + kappa x r_i + r_i' at point k, and r_i.
  pade::Three u(int k, int i, pade::Three& r) {
    const double s = parameters.body_length * k / (rod.points() - 1);
    const double angle = parameters.tca_azimuth[i] + parameters.tca_helix[i] * s;
    r = parameters.tca_offset * pade::Three(std::cos(angle), std::sin(angle), 0.0);
    const pade::Three slope = parameters.tca_helix[i] * pade::Three(-r[1], r[0], 0.0);
    return state.strain(k).tail<3>() + state.strain(k).head<3>().cross(r) + slope;
  }

  Parameters parameters;
  Inputs inputs;
  GridRod rod;
  std::vector<double> memory;
  GridState state;
  GridScratch scratch;
};

/// Distance of two shapes and sets of displacements [m].
double difference(const Outputs& a, const Outputs& b) {
  double worst = 0.0;
  for (std::size_t m = 0; m < shape_stations; ++m)
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(a.shape[m][c] - b.shape[m][c]));
  for (std::size_t i = 0; i < tca_count; ++i) worst = std::max(worst, std::abs(a.delta[i] - b.delta[i]));
  return worst;
}

/// Everything at once: helical TCAs, heat, gravity and tip loads that grow smoothly from rest.
template <class Stepper>
void shake(Inputs& u, double end, int steps, const Stepper& step) {
  const double h = end / steps;
  for (int i = 0; i < steps; ++i) {
    const double t = i * h;
    u.gravity[0] = {800.0 * t * t, 1600.0 * t, 1600.0, 0.0};
    u.tip_force[1] = {0.1 * t * t, 0.2 * t, 0.2, 0.0};
    u.tip_moment[2] = {1e-3 * t * t, 2e-3 * t, 2e-3, 0.0};
    u.T[0] = {298.15 + 4000.0 * t * t, 8000.0 * t, 8000.0, 0.0};
    step(h);
  }
  for (auto* load : {&u.gravity[0], &u.tip_force[1], &u.tip_moment[2], &u.T[0]})
    *load = {(*load)[0] + h * (*load)[1] + h * h / 2 * (*load)[2], 0.0, 0.0, 0.0};
}

Parameters twisted(double retardation) {
  Parameters p;
  p.body_retardation = retardation;
  for (std::size_t i = 0; i < tca_count; ++i) p.tca_helix[i] = i % 2 ? -20.0 : 30.0;
  return p;
}

Outputs shaken(const Parameters& p, int points, int steps) {
  GridBench bench(p, points);
  shake(bench.inputs, 0.04, steps, [&bench](double h) { bench.step(h); });
  return bench.look();
}

}  // namespace

TEST(RodPadeScheme, EveryRowIsExactForQuarticsAndEveryIntervalForCubics) {
  for (int n : {5, 6, 9})
    for (int k = 0; k < n; ++k) {
      const pade::Row row = pade::compact_row(k, n);
      for (int degree = 0; degree <= 5; ++degree) {
        double error = 0.0;
        for (int j = 0; j < row.count; ++j) {
          const double s = row.first + j;
          error += row.slope[j] * degree * std::pow(s, std::max(degree - 1, 0)) - row.value[j] * std::pow(s, degree);
        }
        if (degree <= 4)
          EXPECT_NEAR(error, 0.0, 1e-10) << "row " << k << " of " << n << ", degree " << degree;
        else
          EXPECT_GT(std::abs(error), 0.1) << "row " << k << " of " << n << " would be of fifth order";
      }
      if (k == n - 1) continue;
      const pade::Interval part = pade::interval(k, n);
      for (int degree = 0; degree <= 3; ++degree) {
        double sum = 0.0;
        for (int j = 0; j < pade::reach; ++j) sum += part.weight[j] * std::pow(part.first + j, degree);
        EXPECT_NEAR(sum, (std::pow(k + 1, degree + 1) - std::pow(k, degree + 1)) / (degree + 1), 1e-10);
      }
    }
}

TEST(RodPadeScheme, WavesNeitherGrowNorDecayWithTheClosuresChosen) {
  // xi. = eta', eta. = xi' with eta_0 = 0 and xi_{n-1} = 0: rows 0 ... n - 2 give xi., rows 1 ... n - 1 give eta. .
  for (int n : {5, 11, 21, 41}) {
    const int m = n - 1;
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n), B = A;
    for (int k = 0; k < n; ++k) {
      const pade::Row row = pade::compact_row(k, n);
      for (int j = 0; j < row.count; ++j)
        A(k, row.first + j) = row.slope[j], B(k, row.first + j) = (n - 1) * row.value[j];
    }
    Eigen::MatrixXd rates = Eigen::MatrixXd::Zero(2 * m, 2 * m);
    rates.topRightCorner(m, m) = A.topLeftCorner(m, m).lu().solve(B.topRightCorner(m, m));
    rates.bottomLeftCorner(m, m) = A.bottomRightCorner(m, m).lu().solve(B.bottomLeftCorner(m, m));
    const Eigen::VectorXcd modes = rates.eigenvalues();
    EXPECT_LT(modes.real().cwiseAbs().maxCoeff(), 1e-9 * modes.cwiseAbs().maxCoeff()) << n << " points";
    EXPECT_NEAR(modes.cwiseAbs().minCoeff(), M_PI / 2, n < 11 ? 1e-3 : 1e-5);

    // The other choice of closures: rates all but undetermined.
    const auto sizes = [](const Eigen::MatrixXd& a) { return a.jacobiSvd().singularValues(); };
    const Eigen::VectorXd chosen = sizes(A.topLeftCorner(m, m)), other = sizes(A.bottomLeftCorner(m, m));
    EXPECT_LT(chosen.maxCoeff() / chosen.minCoeff(), 100.0);
    EXPECT_GT(other.maxCoeff() / other.minCoeff(), std::min(1e12, std::pow(3.0, n - 2)));
  }
}

TEST(RodPadeNode, DerivativesAreExact) {
  std::srand(3);
  pade::Medium medium{.stiffness = pade::Six::Random().cwiseAbs(),
                      .damping = pade::Six::Random().cwiseAbs(),
                      .inertia = pade::Six::Random().cwiseAbs(),
                      .reference = pade::Six::Unit(5),
                      .mass = 0.7};
  medium.inertia.tail<3>().setConstant(0.4);  // a mass is the same in all directions
  for (double spin : {1e-3, 1.0}) {           // both forms of the rotation's coefficients
    pade::Before before{
        .z = pade::Unknowns::Random(), .gravity = pade::Three::Random(), .stretch = {}, .r = {}, .r_slope = {}};
    before.stretch.setOnes();
    for (std::size_t i = 0; i < tca_count; ++i)
      before.r[i] = 0.1 * pade::Three::Random(), before.r_slope[i] = 0.1 * pade::Three::Random();
    pade::Unknowns z = pade::Unknowns::Random();
    z.segment<3>(6) *= spin;
    pade::PerTcaVector N = pade::PerTcaVector::Random();
    pade::Balance exact, ahead, behind;
    balance(medium, before, z, N, exact);
    const double step = 1e-6;
    for (int j = 0; j < pade::fields; ++j) {
      const pade::Unknowns e = step * pade::Unknowns::Unit(j);
      balance(medium, before, z + e, N, ahead);
      balance(medium, before, z - e, N, behind);
      EXPECT_LT(((ahead.eta_slope - behind.eta_slope) / (2 * step) - exact.eta_slope_z.col(j)).norm(), 1e-8);
      EXPECT_LT(((ahead.W - behind.W) / (2 * step) - exact.W_z.col(j)).norm(), 1e-8);
      EXPECT_LT(((ahead.W_slope - behind.W_slope) / (2 * step) - exact.W_slope_z.col(j)).norm(), 1e-8);
      if (j < 6) {
        EXPECT_LT(((ahead.stretch - behind.stretch) / (2 * step) - exact.stretch_xi.row(j).transpose()).norm(), 1e-8);
      }
    }
    for (int i = 0; i < tcas; ++i) {
      const pade::PerTcaVector e = step * pade::PerTcaVector::Unit(i);
      balance(medium, before, z, N + e, ahead);
      balance(medium, before, z, N - e, behind);
      EXPECT_LT(((ahead.W - behind.W) / (2 * step) - exact.W_N.col(i)).norm(), 1e-8);
      EXPECT_LT(((ahead.W_slope - behind.W_slope) / (2 * step) - exact.W_slope_N.col(i)).norm(), 1e-8);
    }
  }
}

TEST(RodPadeSolver, AgreesWithADenseSolverAlsoWhereDiagonalBlocksVanish) {
  constexpr int fields = pade::fields, width = pade::reach * fields, columns = pade::FrontSolver::columns;
  for (int n : {5, 6, 12}) {
    pade::FrontSolver solver;
    solver.resize(n);
    for (int pass = 0; pass < 2; ++pass) {  // the second with the memory of the first
      std::srand(n + pass);
      solver.clear();
      Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n * fields, n * fields), B(n * fields, columns);
      int at = 0;
      const auto add = [&](int first, int points, int own) {
        pade::FrontSolver::Equation& e = solver.add(first);
        for (int c = 0; c < std::min(width, points * fields); ++c) {
          if (pass == 1 && c / fields == own) continue;  // no coefficients at the equation's own point
          e.a[c] = A(at, first * fields + c) = Eigen::internal::random<double>(-1, 1);
        }
        for (int s = 0; s < columns; ++s) e.b[s] = B(at, s) = Eigen::internal::random<double>(-1, 1);
        ++at;
      };
      for (int k = 0; k < n; ++k)
        for (int half = 0; half < 2; ++half)
          for (int j = 0; j < fields / 2; ++j) {
            if (k == 0)
              add(0, half ? pade::reach : 1, -1);
            else if (k == n - 1)
              half ? add(n - 1, 1, -1) : add(n - 4, pade::reach, -1);
            else
              add(k - 1, 3, 1);
          }
      ASSERT_EQ(at, n * fields);
      ASSERT_TRUE(solver.solve());
      const Eigen::MatrixXd x = A.fullPivLu().solve(B);
      for (int u = 0; u < n * fields; ++u)
        for (int s = 0; s < columns; ++s)
          EXPECT_NEAR(solver(u / fields, u % fields, s), x(u, s), 1e-8 * x.cwiseAbs().maxCoeff());
    }
    solver.clear();
    for (int k = 0; k < n; ++k)
      for (int j = 0; j < fields; ++j) solver.add(k == n - 1 ? (j < 6 ? n - 4 : n - 1) : std::max(k - 1, 0));
    EXPECT_FALSE(solver.solve()) << "a singular system must be noticed";
  }
}

TEST(RodPade, IsOfFourthOrderInSpace) {
  for (double retardation : {0.0, 5e-3}) {
    const Parameters p = twisted(retardation);
    const Outputs fine = shaken(p, 161, 20);
    double last = 0.0;
    for (int points : {11, 21, 41}) {
      const double error = difference(shaken(p, points, 20), fine);
      if (last > 0.0) {
        EXPECT_GT(std::log2(last / error), 3.7) << points << " points, retardation " << retardation;
        EXPECT_LT(std::log2(last / error), 4.5) << points << " points, retardation " << retardation;
      }
      last = error;
    }
    EXPECT_LT(last, 1e-9);
  }
}

TEST(RodPade, IsOfFirstOrderInTime) {
  for (double retardation : {0.0, 5e-3}) {
    const Parameters p = twisted(retardation);
    const Outputs fine = shaken(p, 15, 2560);
    double last = 0.0;
    for (int steps : {40, 80, 160}) {
      const double error = difference(shaken(p, 15, steps), fine);
      if (last > 0.0) {
        EXPECT_GT(std::log2(last / error), 0.9) << steps << " steps, retardation " << retardation;
        EXPECT_LT(std::log2(last / error), 1.2) << steps << " steps, retardation " << retardation;
      }
      last = error;
    }
  }
}

TEST(RodPade, MeetsTheStrainPolynomialsAsTheStepShrinks) {
  Parameters p = twisted(5e-3);
  p.order = 6;
  Bench other(p);
  shake(other.inputs, 0.04, 40, [&other](double h) {
    ASSERT_EQ(step_rosenbrock(other.rod, other.inputs, h, 1e-8, other.state, other.scratch).reached, h);
  });
  const Outputs truth = other.look();
  const Outputs coarse = shaken(p, 41, 320), fine = shaken(p, 41, 640);
  EXPECT_LT(difference(fine, truth), 0.55 * difference(coarse, truth));
  // Richardson's extrapolation to step 0.
  Outputs limit = fine;
  for (std::size_t m = 0; m < shape_stations; ++m)
    for (int c = 0; c < 3; ++c) limit.shape[m][c] = 2 * fine.shape[m][c] - coarse.shape[m][c];
  for (std::size_t i = 0; i < tca_count; ++i) limit.delta[i] = 2 * fine.delta[i] - coarse.delta[i];
  EXPECT_LT(difference(limit, truth), 0.02 * difference(fine, truth));
}

TEST(RodPade, DampedReleaseAgainstTheReference) {
  const auto row = rod_test::read_csv("rod_release.csv").front();
  Parameters p = bare_rod();
  p.body_retardation = 5e-3;
  const auto tip = [&](int steps) {  // mm
    GridBench bench(p, 21);
    bench.inputs.gravity[0][0] = 9.81;
    for (int i = 0; i < steps; ++i) bench.step(row[0] / steps);
    const Outputs y = bench.look();
    return Eigen::Vector2d(1e3 * y.tip_p[2], 1e3 * y.tip_p[0]);
  };
  const Eigen::Vector2d truth(row[3], row[4]), coarse = tip(200), fine = tip(400);
  EXPECT_LT((fine - truth).norm(), 1e-2);
  EXPECT_NEAR((coarse - truth).norm() / (fine - truth).norm(), 2.0, 0.1);
  EXPECT_LT((2 * fine - coarse - truth).norm(), 3e-4);
}

TEST(RodPade, ComesToRestAtTheReferenceEquilibria) {
  for (const auto& row : rod_test::read_csv("rod_static.csv")) {
    Parameters p;
    p.body_retardation = 20e-3;
    const auto error = [&row](GridBench& bench) {
      const Outputs y = bench.look();
      double worst = 0.0;
      for (int c = 0; c < 3; ++c)
        worst = std::max({worst, std::abs(y.tip_p[c] - row[7 + c]), std::abs(y.delta[c] - row[13 + c])});
      return worst;
    };
    const auto load = [&row](GridBench& bench) {
      for (int c = 0; c < 3; ++c) bench.inputs.gravity[c][0] = row[1 + c];
      for (std::size_t i = 0; i < tca_count; ++i) bench.inputs.T[i][0] = row[4 + i] + 273.15;
    };
    const auto after_damped_motion = [&](double h) {
      GridBench bench(p, 41);
      for (int i = 0; i < std::lround(1.0 / h); ++i) {  // loads grow for a second
        const double t = i * h;
        for (int c = 0; c < 3; ++c) bench.inputs.gravity[c] = {row[1 + c] * t, row[1 + c], 0.0, 0.0};
        for (std::size_t k = 0; k < tca_count; ++k)
          bench.inputs.T[k] = {298.15 + (row[4 + k] - 25) * t, row[4 + k] - 25, 0.0, 0.0};
        bench.step(h);
      }
      bench.inputs = Inputs{};
      load(bench);
      for (int i = 0; i < std::lround(1.0 / h); ++i) bench.step(h);
      EXPECT_LT(bench.look().energy_kinetic, 1e-20);
      return error(bench);
    };
    GridBench placed(p, 41);
    load(placed);
    ASSERT_TRUE(placed.settle());
    EXPECT_LT(error(placed), 1e-8);
    // After motion, what eps' fell short on the way remains; it shrinks with the step.
    const double coarse = after_damped_motion(10e-3), fine = after_damped_motion(5e-3);
    EXPECT_LT(coarse, 1e-6);
    EXPECT_TRUE(fine < 0.6 * coarse || fine < 1e-8) << fine << " m after " << coarse << " m";
  }
}

TEST(RodPade, EquilibriaConvergeWithFourthOrder) {
  const auto tip = [](int points) {
    GridBench bench(twisted(0.0), points);
    bench.inputs.gravity[0][0] = 9.81;
    bench.inputs.T[0][0] = 340.0;
    EXPECT_TRUE(bench.settle());
    return bench.look();
  };
  const Outputs fine = tip(161);
  EXPECT_GT(std::log2(difference(tip(11), fine) / difference(tip(21), fine)), 3.5);
  EXPECT_GT(std::log2(difference(tip(21), fine) / difference(tip(41), fine)), 3.5);

  Parameters p = twisted(0.0);
  p.order = 7;
  Bench other(p);
  other.inputs.gravity[0][0] = 9.81;
  other.inputs.T[0][0] = 340.0;
  ASSERT_TRUE(other.settle());
  EXPECT_LT(difference(fine, other.look()), 1e-8);
}

TEST(RodPade, TipBalanceHasTheRightSign) {
  // Unloaded but hot: W_tot = K (xi - xi*) + sum N [r x t; t] vanishes all along. With the sign of Eq. 23 as printed
  // the base would carry 2 sum N [r x t; t] instead, which is far from nothing here.
  Parameters p;
  GridBench bench(p, 21);
  bench.inputs.T[0][0] = 350.0;
  ASSERT_TRUE(bench.settle());
  const Section section = Section::of(p);
  const Outputs y = bench.look();
  for (int k = 0; k < bench.rod.points(); ++k) {
    pade::Six elastic, actuators = pade::Six::Zero();
    for (int c = 0; c < 6; ++c) elastic[c] = section.stiffness[c] * (bench.state.strain(k)[c] - section.reference[c]);
    for (int i = 0; i < tcas; ++i) {
      pade::Three r;
      const pade::Three t = bench.u(k, i, r).normalized();
      actuators.head<3>() += y.N[i] * r.cross(t);
      actuators.tail<3>() += y.N[i] * t;
    }
    EXPECT_LT((elastic + actuators).head<3>().norm(), 1e-12);
    EXPECT_LT((elastic + actuators).tail<3>().norm(), 1e-10);
    EXPECT_GT(2 * actuators.head<3>().norm(), 1e-4);
    EXPECT_GT(2 * actuators.tail<3>().norm(), 1e-2);
  }
}

TEST(RodPade, TipLoadsAreDeadLoadsOfTheFixedFrame) {
  Parameters p = bare_rod();
  GridBench bench(p, 81);
  bench.inputs.tip_moment[1][0] = 2 * M_PI * Section::of(p).stiffness[1] / p.body_length;
  ASSERT_TRUE(bench.settle());
  for (double x : bench.look().tip_p) EXPECT_NEAR(x, 0.0, 1e-6 * p.body_length);  // the rod closes to a circle

  p.order = 7;
  Bench other(p);
  GridBench pulled(p, 41);
  other.inputs.tip_force[1][0] = pulled.inputs.tip_force[1][0] = 0.02;
  other.inputs.tip_force[2][0] = pulled.inputs.tip_force[2][0] = -0.01;
  ASSERT_TRUE(pulled.settle() && other.settle());
  EXPECT_LT(difference(pulled.look(), other.look()), 1e-7);
}

TEST(RodPade, StretchEvolvedInTimeFollowsTheStrain) {
  // eps' falls short of |u| by the squares of the angles that u turned: first order in the step.
  const auto gap = [](int steps) {
    GridBench bench(twisted(5e-3), 15);
    shake(bench.inputs, 0.04, steps, [&bench](double h) { bench.step(h); });
    double worst = 0.0;
    for (int k = 0; k < bench.rod.points(); ++k)
      for (int i = 0; i < tcas; ++i) {
        pade::Three r;
        worst = std::max(worst, std::abs(bench.state.stretch(k)[i] - bench.u(k, i, r).norm()));
      }
    return worst;
  };
  const double coarse = gap(80), fine = gap(160);
  EXPECT_LT(coarse, 1e-5);
  EXPECT_GT(fine, 1e-12) << "evolved, not computed from the strain";
  EXPECT_NEAR(coarse / fine, 2.0, 0.2);
}

TEST(RodPade, PoseBelongsToTheStrainAndStaysOnTheGroup) {
  GridBench bench(twisted(0.0), 41);
  shake(bench.inputs, 0.04, 40, [&bench](double h) { bench.step(h); });
  for (int k = 0; k < 41; ++k) EXPECT_NEAR(bench.state.quaternion(k).norm(), 1.0, 1e-14);
  // Central differences of the pose give the strain back.
  const double spacing = bench.parameters.body_length / 40;
  for (int k = 1; k < 40; ++k) {
    const auto q = [&](int j) {
      const auto c = bench.state.quaternion(j);
      return Eigen::Quaterniond(c[0], c[1], c[2], c[3]);
    };
    const Eigen::AngleAxisd turn(q(k - 1).conjugate() * q(k + 1));
    const pade::Three kappa = turn.angle() * turn.axis() / (2 * spacing);
    EXPECT_LT((kappa - bench.state.strain(k).head<3>()).norm(), 0.1);  // 1/m, of some 20
    const pade::Three slope = (bench.state.position(k + 1) - bench.state.position(k - 1)) / (2 * spacing);
    EXPECT_LT((q(k).conjugate() * slope - bench.state.strain(k).tail<3>()).norm(), 2e-3);
  }
}

TEST(RodPade, DisplacementRateIsItsDifferenceQuotient) {
  GridBench bench(Parameters{}, 11);
  bench.inputs.gravity[0][0] = 9.81;
  for (int i = 0; i < 5; ++i) bench.step(1e-3);
  const Outputs before = bench.look();
  bench.step(1e-4);
  const Outputs after = bench.look();
  for (std::size_t i = 0; i < tca_count; ++i) {
    EXPECT_NEAR(after.delta_rate[i], (after.delta[i] - before.delta[i]) / 1e-4, 1e-9);
    EXPECT_GT(std::abs(after.delta_rate[i]), 1e-4);
  }
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(after.tip_v[c], (after.tip_p[c] - before.tip_p[c]) / 1e-4, 1e-2 * std::abs(after.tip_v[0]));
}

TEST(RodPade, ExchangedTensionsFollowTheGuessOnly) {
  Parameters p;
  GridBench inside(p, 21);
  inside.inputs.gravity[0][0] = 9.81;
  inside.inputs.T[1][0] = 330.0;
  p.closure = Closure::exchanged;
  GridBench exchanged(p, 21);
  exchanged.inputs = inside.inputs;
  ASSERT_TRUE(inside.settle());
  const Outputs truth = inside.look();
  for (std::size_t i = 0; i < tca_count; ++i) exchanged.inputs.delta_guess[i][0] = truth.delta[i];
  ASSERT_TRUE(exchanged.settle());
  EXPECT_LT(difference(exchanged.look(), truth), 1e-9);
  exchanged.inputs.delta_guess[0][0] += 1e-3;
  const Outputs off = exchanged.look();
  EXPECT_NEAR(off.N[0] - truth.N[0], TcaLaw(p).stiffness() * 1e-3, 1e-6);
  EXPECT_NEAR(off.delta[0], truth.delta[0], 1e-9) << "delta belongs to the shape";
}

TEST(RodPade, FreeMotionLosesEnergy) {
  for (double retardation : {0.0, 5e-3}) {
    Parameters p;
    p.body_retardation = retardation;
    GridBench bench(p, 21);
    bench.inputs.gravity[0][0] = 9.81;
    bench.inputs.T[1][0] = 320.0;
    const auto total = [&bench] {
      const Outputs y = bench.look();
      return y.energy_kinetic + y.energy_elastic + y.energy_gravity + y.energy_tca + y.energy_dissipated;
    };
    const double start = total();
    double last = start, heat = 0.0;
    for (int i = 0; i < 200; ++i) {
      bench.step(1e-3);
      EXPECT_LT(total(), last + 1e-9 * start);
      EXPECT_GE(bench.look().energy_dissipated, heat);
      last = total();
      heat = bench.look().energy_dissipated;
    }
    EXPECT_LT(last, start);
    EXPECT_EQ(heat > 1e-6, retardation > 0.0);
  }
}

TEST(RodPade, RestoredMemoryStepsBitwiseTheSame) {
  GridBench one(twisted(5e-3), 21), two(twisted(5e-3), 21);
  shake(one.inputs, 0.02, 10, [&one](double h) { one.step(h); });
  two.inputs = one.inputs;
  two.memory.assign(one.memory.begin(), one.memory.end());
  two.state = GridState(two.memory.data(), 21);
  for (int i = 0; i < 3; ++i) one.step(2e-3), two.step(2e-3);
  EXPECT_EQ(one.memory, two.memory);
}

TEST(RodPade, NewtonsFailureHalvesTheStepOrEndsItEarly) {
  // The rate of displacement is that of the last piece, so it tells whether a step went in one piece.
  const auto mean_against_last = [](double gravity) {
    GridBench bench(Parameters{}, 21);
    const double h = 1e-3;
    bench.inputs.gravity[2][0] = -gravity;
    bench.step(h);
    const Outputs y = bench.look();
    return y.delta[0] / h / y.delta_rate[0];
  };
  EXPECT_NEAR(mean_against_last(10.0), 1.0, 1e-9);
  EXPECT_GT(std::abs(mean_against_last(1e4) - 1.0), 0.01);

  GridBench part(Parameters{}, 21);
  part.inputs.gravity[1][0] = 3000.0;
  const Advance some = part.rod.step(part.inputs, 0.01, part.state, part.scratch);
  EXPECT_GT(some.reached, 0.0);
  EXPECT_LT(some.reached, 0.01);
  EXPECT_FALSE(some.trouble.empty());
  for (double x : part.memory) EXPECT_TRUE(std::isfinite(x));
  EXPECT_GT(part.rod.step(part.inputs, 1e-5, part.state, part.scratch).reached, 0.0) << "on it goes, slowly";

  GridBench none(Parameters{}, 21);
  none.inputs.tip_moment[1][0] = 0.1;  // 200 radians
  const std::vector<double> before = none.memory;
  EXPECT_EQ(none.rod.step(none.inputs, 1e-3, none.state, none.scratch).reached, 0.0);
  EXPECT_EQ(none.memory, before);
}

TEST(RodPade, ViolentStepsConvergeOrLeaveTheStateUsable) {
  for (double h : {1e-4, 1e-2, 10.0})
    for (double force : {0.0, 1.0, 50.0})
      for (double kelvin : {0.0, 300.0}) {
        GridBench bench(Parameters{}, 21);
        bench.inputs.tip_force[0][0] = force;
        bench.inputs.T[0][0] += kelvin;
        const std::vector<double> before = bench.memory;
        const Advance result = bench.rod.step(bench.inputs, h, bench.state, bench.scratch);
        EXPECT_TRUE(result.reached == h ? result.trouble.empty() : !result.trouble.empty());
        for (double x : bench.memory) EXPECT_TRUE(std::isfinite(x));
        if (result.reached == 0.0) {
          EXPECT_EQ(bench.memory, before);
        }
        EXPECT_EQ(bench.rod.step(bench.inputs, 1e-3, bench.state, bench.scratch).reached, 1e-3)  // and on it goes
            << "after h = " << h << " s, " << force << " N, " << kelvin << " K";
      }
}

TEST(RodPade, HeatAtAStrokeIsApproachedInShares) {
  // 300 K in one long step: the section is unstable at the first guess; the end is the equilibrium all the same.
  Parameters p;
  GridBench bench(p, 21);
  Bench other(p);
  bench.inputs.T[0][0] = other.inputs.T[0][0] = 598.15;
  bench.step(1e3);
  for (int i = 0; i < 3; ++i) bench.step(1e3);
  ASSERT_TRUE(other.settle());
  EXPECT_LT(difference(bench.look(), other.look()), 1e-3 * p.body_length);
}

TEST(RodPade, NoStepAllocates) {
  GridBench bench(twisted(5e-3), 21);
  bench.inputs.gravity[0][0] = 9.81;
  bench.inputs.T[0] = {310.0, 10.0, 0.0, 0.0};
  const std::size_t before = rod_test::allocations;
  bench.step(1e-2);
  bench.inputs.T[0][0] = 500.0;  // approached in shares
  bench.step(1e-2);
  bench.settle();
  bench.look();
  EXPECT_EQ(rod_test::allocations, before);
}

TEST(RodPadeFmu, RefusesGridsOutOfRangeAndOtherStrains) {
  probe::Host host;
  for (int points : {-1, 4, 402}) {
    EXPECT_EQ(host.set_integer("grid_points", points), fmi2Error);
    EXPECT_TRUE(host.said({"grid_points = " + std::to_string(points), "5 to 401"}));
  }
  EXPECT_EQ(host.set_integer("grid_points", 5), fmi2OK);
  EXPECT_EQ(host.set_integer("grid_points", 401), fmi2OK);
  EXPECT_EQ(host.set_integer("method", static_cast<int>(Method::pade_euler)), fmi2OK);
  EXPECT_EQ(host.set_integer("strains", static_cast<int>(Strains::kirchhoff)), fmi2OK);
  EXPECT_EQ(fmi2EnterInitializationMode(host.fmu), fmi2OK);
  EXPECT_EQ(fmi2ExitInitializationMode(host.fmu), fmi2Error);
  EXPECT_TRUE(host.said({"pade_euler", "strains = 3", "cosserat"}));
}

TEST(RodPadeFmu, StepsRestoresAndFillsItsOutputs) {
  probe::Host host;
  host.set_integer("method", static_cast<int>(Method::pade_euler));
  host.set("gravity[1]", 9.81);
  host.set("body.retardation", 5e-3);
  host.start();
  const auto step = [&host](double t) { return fmi2DoStep(host.fmu, t, 1e-3, fmi2True); };
  EXPECT_EQ(step(0.0), fmi2OK);
  fmi2FMUstate state = nullptr;
  ASSERT_EQ(fmi2GetFMUstate(host.fmu, &state), fmi2OK);
  const auto values = [&host] {
    std::vector<double> all;
    for (const char* name : {"delta[1]", "N[1]", "tip.p[1]", "tip.euler[2]", "tip.v[1]", "energy.elastic", "energy.tca",
                             "energy.kinetic", "energy.gravity", "energy.dissipated", "shape.p[11,1]"})
      all.push_back(host.get(name));
    return all;
  };
  EXPECT_EQ(step(1e-3), fmi2OK);
  const std::vector<double> first = values();
  for (double value : first) EXPECT_NE(value, 0.0);
  ASSERT_EQ(fmi2SetFMUstate(host.fmu, state), fmi2OK);
  EXPECT_NE(values(), first);
  EXPECT_EQ(step(1e-3), fmi2OK);
  EXPECT_EQ(values(), first);
  fmi2FreeFMUstate(host.fmu, &state);
}
