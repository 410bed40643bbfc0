// Electrical feedback, R = R_ref [1 + alpha_T (T - T_ref) + beta delta/L]: against an independent integration, and its
// order.
#include <gtest/gtest.h>

#include "thermal_scene.hpp"

namespace thermal {
namespace {

/// Rises after `last` by the classical Runge-Kutta method on the modal equations.
PerTca by_runge_kutta(const Parameters& p, const ModalModel& m, const Drive& drive, double last, int steps) {
  const auto slope = [&](const Eigen::VectorXd& z, double s) {
    Eigen::VectorXd w(static_cast<Eigen::Index>(p.tca.count) + 1);
    for (int i = 0; i < static_cast<int>(p.tca.count); ++i) {
      const double T = p.T_0 + m.load.col(i).dot(z);
      const double R = p.tca.R[i] * (1.0 + p.tca.alpha_T[i] * (T - p.tca.T_ref) +
                                     p.tca.beta[i] * value(drive.delta[i], s) / p.body.length);
      w[i] = std::pow(value(drive.V[i], s), 2) / R;
    }
    w[p.tca.count] = value(drive.ambient_rise, s);
    return Eigen::VectorXd(m.load * w - m.rate.cwiseProduct(z));
  };
  Eigen::VectorXd z = Eigen::VectorXd::Zero(m.size());
  const double h = last / steps;
  for (int n = 0; n < steps; ++n) {
    const double s = n * h;
    const Eigen::VectorXd a = slope(z, s), b = slope(z + 0.5 * h * a, s + 0.5 * h),
                          c = slope(z + 0.5 * h * b, s + 0.5 * h), d = slope(z + h * c, s + h);
    z += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
  }
  PerTca rises;
  for (std::size_t i = 0; i < p.tca.count; ++i) rises[i] = m.load.col(static_cast<Eigen::Index>(i)).dot(z);
  return rises;
}

TEST(Feedback, ReducedAndLumpedAgreeWithRungeKutta) {
  const HeatMatrices m = must(heat_matrices({}, 3));
  const ModalModel small = reduced(m, 1e-3);
  for (const ModalModel& model : {small, lumped(m, small)}) {
    const Parameters p = with_feedback(Level::reduced);
    const Drive drive = smooth_scene();
    const int steps = static_cast<int>(std::ceil(10.0 * model.rate.maxCoeff()));
    const PerTca coarse = by_runge_kutta(p, model, drive, 10.0, steps),
                 fine = by_runge_kutta(p, model, drive, 10.0, 2 * steps);
    const auto level = make_modal_level(model, p);
    std::vector<double> state(level->state_size(), 0.0);
    must(level->advance(state, drive, 10.0, 1e-10));
    Observation observed;
    must(level->observe(state, drive, observed));
    const PerTca seen = observed.rise;
    EXPECT_LT(gap(seen, fine), 1e-8 + gap(coarse, fine));
    EXPECT_GT(seen[2], 30.0);
  }
}

TEST(Feedback, PathHasOrderSixOrMoreInStepLength) {
  // A tolerance beyond reach of any error switches the halving off, so that one step is one collocation.
  constexpr double kNoHalving = 1e300;
  const Parameters p = with_feedback(Level::reduced);
  const ModalModel model = reduced(must(heat_matrices({}, 3)), 1e-3);
  const Drive drive = smooth_scene();
  const auto rises = [&](int steps) { return stepped(model, p, drive, 8.0, steps, kNoHalving); };
  const PerTca truth = rises(64);
  const double one = gap(rises(1), truth), two = gap(rises(2), truth), four = gap(rises(4), truth);
  EXPECT_GT(std::log2(one / two), 6.0);
  EXPECT_GT(std::log2(two / four), 6.0);
}

TEST(Feedback, HalvingKeepsTheTolerance) {
  Drive drive = step_scene();
  drive.V[2][0] = 12.0;
  Parameters p = with_feedback(Level::reduced);
  p.tolerance = 1e-5;
  Trajectory whole = run_of(p, 4), parts = run_of(p, 4);
  whole.advance(drive, 20.0);
  for (int n = 0; n < 2000; ++n) parts.advance(drive, 0.01);
  const Observation a = whole.observe(drive), b = parts.observe(drive);
  EXPECT_LT(gap(a.rise, b.rise), 1e-5 * b.rise[2]);
  EXPECT_GT(b.rise[2], 200.0);
}

TEST(Feedback, FullAgreesWithReduced) {
  const Drive drive = smooth_scene();
  Trajectory full = run_of(with_feedback(Level::full), 4), small = run_of(with_feedback(Level::reduced), 4);
  full.advance(drive, 10.0);
  small.advance(drive, 10.0);
  EXPECT_LT(gap(full.observe(drive).rise, small.observe(drive).rise), 1e-5 * small.observe(drive).rise[2]);
  // and the feedback is felt
  Trajectory without = run_of({}, 4);
  without.advance(drive, 10.0);
  EXPECT_GT(gap(without.observe(drive).rise, small.observe(drive).rise), 1.0);
}

TEST(Feedback, WithoutItTheExactPathIsTaken) {
  Parameters tiny;
  tiny.tca.alpha_T = filled(1e-300);
  Trajectory exact = run_of({}, 4), collocated = run_of(tiny, 4);
  const Drive drive = smooth_scene();
  exact.advance(drive, 3.0);
  collocated.advance(drive, 3.0);
  EXPECT_LT(gap(exact.observe(drive).rise, collocated.observe(drive).rise), 1e-10);
}

TEST(Feedback, ResistanceThatVanishesIsRefusedAtEveryLevel) {
  for (Level level : {Level::lumped, Level::reduced, Level::full}) {
    Parameters p = with_feedback(level);
    p.tca.alpha_T = filled(-0.02);  // R = 0 at +50 K
    Trajectory run = run_of(p, 3);
    Drive drive;
    drive.V[0][0] = 5.0;
    try {
      run.advance(drive, 1000.0);
      ADD_FAILURE() << "level " << static_cast<int>(level) << " went on";
    } catch (const std::runtime_error& problem) {
      EXPECT_NE(std::string(problem.what()).find("tca.alpha_T"), std::string::npos) << problem.what();
    }
  }
}

}  // namespace
}  // namespace thermal
