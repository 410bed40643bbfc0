// Rosenbrock methods (rosenbrock_tableaus.hpp) for systems of index 1. The rod is one: dq/dt = v, dv/dt = a,
// 0 = r(q, v, a, t). Eliminating the first two rows of every stage leaves one matrix, r_q + g r_v + g^2 r_a with
// g = 1/(gamma h), factored once per step. There is no iteration that could fail to converge, and no history that a
// rollback would lose.
#include <array>
#include <cmath>

#include "integration/dense_output.hpp"
#include "integration/rosenbrock_tableaus.hpp"
#include "numerics/arrays.hpp"

namespace rod {

namespace {

constexpr double kStrainScale = 0.1;   // strain [1] below which the error is absolute
constexpr int kTrialAttempts = 20000;  // after so many steps a call that would need ten times the bound ends
constexpr double kMinCrossing = 1.1;   // a step crosses the communication point if it is longer by this factor
constexpr double kMaxCrossing = 10.0;  // of such a step, in radians of the first mode: beyond, rounding of rates shows
constexpr double kMaxStretch = 1.05;   // of a step that then ends at the communication point; its error still passes
constexpr double kMinStep = 1e-9;      // of the communication step, or of the rod's time scale

/// One step of a method from a state: increments of the stages, solution and error. The workspace `start` and the
/// residual scratch.r belong to the state when the step begins.
template <class Tableau>
class RosenbrockStep {
 public:
  RosenbrockStep(const Rod& rod, const Inputs& u, bool are_constant, const State& state, Scratch& scratch)
      : rod_(rod),
        u_(u),
        are_constant_(are_constant),
        state_(state),
        start_(scratch.newton.work),
        start_r_(scratch.r),
        work_(scratch.work),
        U_(scratch.stages.U),
        y_(scratch.stages.y),
        r_(scratch.stages.r),
        r_t_(scratch.stages.r_t),
        b1_(scratch.stages.b1),
        b2_(scratch.stages.b2),
        dr_(scratch.stages.dr),
        power_slope_(scratch.stages.power_slope),
        J_(scratch.stages.J),
        lu_(scratch.stages.lu) {}

  /// Makes the step of length h [s] that starts `from` [s] after the communication point, where the loads are `loads`.
  void compute(double from, double h, const Loads& loads) {
    const double g = 1.0 / (Tableau::kGamma * h);
    const int n = rod_.unknowns();
    rod_.tangent(start_, {1.0, g, g * g}, J_);
    lu_.compute(J_);
    if (are_constant_)
      r_t_.setZero(state_.q.size());
    else
      rod_.load_derivative(start_, loads, load_rates_at(u_, from), r_t_);
    rod_.damping_force(state_.v, power_slope_);
    power_slope_ *= 2.0;

    for (int i = 0; i < Tableau::kStages; ++i) {
      move_to_stage(i);
      b1_ = y_.v;
      b2_ = y_.a;
      double b_e = rod_.damping_power(y_.v);
      std::array<double, kMaxStages> factor;
      for (int j = 0; j < i; ++j) {
        factor[j] = Tableau::kC[i - 1][j] / h;
        b_e += factor[j] * U_[j].e;
      }
      add_products(n, i, factor.data(), q_.data(), b1_.data());
      add_products(n, i, factor.data(), v_.data(), b2_.data());
      if (i < Tableau::kShared)
        r_ = start_r_;
      else
        rod_.residual(y_.q.data(), y_.v.data(), y_.a.data(),
                      are_constant_ ? loads : loads_at(u_, from + Tableau::kNode[i] * h), work_, r_);
      dr_ = g * b1_ + b2_;
      rod_.rate_derivative(start_, b1_, dr_, U_[i].q);
      r_ = U_[i].q - r_ - (h * Tableau::kTimeWeight[i]) * r_t_;
      lu_.solve(r_, U_[i].q);
      U_[i].v = g * U_[i].q - b1_;
      U_[i].a = g * U_[i].v - b2_;
      U_[i].e = (b_e + power_slope_.dot(U_[i].v)) / g;
      q_[i] = U_[i].q.data(), v_[i] = U_[i].v.data(), a_[i] = U_[i].a.data();
    }
    y_.add(1.0, U_[Tableau::kStages - 1]);
  }

  /// State at the end of the step; e is the energy dissipated in it.
  const Point& solution() const { return y_; }

  /// Root mean square over strains and rates of error/(tolerance * size), with one size for the strains and one for the
  /// rates.
  double error_norm(double tolerance) const {
    const Point& error = U_[Tableau::kStages - 1];
    const double q_size = kStrainScale + std::max(state_.q.lpNorm<Eigen::Infinity>(), y_.q.lpNorm<Eigen::Infinity>());
    const double v_size =
        rod_.first_frequency() * q_size + std::max(state_.v.lpNorm<Eigen::Infinity>(), y_.v.lpNorm<Eigen::Infinity>());
    const double sum = error.q.squaredNorm() / (q_size * q_size) + error.v.squaredNorm() / (v_size * v_size);
    return std::sqrt(sum / (2.0 * rod_.unknowns())) / tolerance;
  }

 private:
  /// Sets y_ to the point of stage i.
  void move_to_stage(int i) {
    if (i >= Tableau::kDirect) {
      y_.add(1.0, U_[i - 1]);
      return;
    }
    y_.q = state_.q, y_.v = state_.v, y_.a = state_.a, y_.e = 0.0;
    if (i == 0) return;
    const int n = rod_.unknowns();
    const double* factor = Tableau::kA[i - 1];
    add_products(n, i, factor, q_.data(), y_.q.data());
    add_products(n, i, factor, v_.data(), y_.v.data());
    add_products(n, i, factor, a_.data(), y_.a.data());
    for (int j = 0; j < i; ++j) y_.e += factor[j] * U_[j].e;
  }

  const Rod& rod_;
  const Inputs& u_;
  const bool are_constant_;  // the inputs, in time
  const State& state_;
  const Workspace& start_;
  const Vector& start_r_;
  Workspace& work_;

  std::array<Point, kMaxStages>& U_;
  std::array<const double*, kMaxStages> q_, v_, a_;  // numbers of U_, where it is known
  Point& y_;
  Vector &r_, &r_t_, &b1_, &b2_, &dr_, &power_slope_;
  Matrix& J_;
  PackedLu& lu_;
};

/// Evaluates the residual at the state, with an acceleration that agrees with the loads: after a jump of the inputs the
/// first stages would lose their order otherwise.
core::Status start_step(const Rod& rod, const Loads& loads, double tolerance, State& state, Scratch& scratch) {
  const auto evaluate = [&] {
    rod.residual(state.q.data(), state.v.data(), state.a.data(), loads, scratch.newton.work, scratch.r);
  };
  evaluate();
  const double imbalance = (scratch.r.array() / rod.stiffness().array()).abs().maxCoeff();
  if (imbalance < tolerance * kStrainScale) return {};
  core::Status status = solve_acceleration(rod, loads, state, scratch);
  if (status.is_ok()) evaluate();
  return status;
}

/// First step of a motion [radians of the first mode]: it grows with the fifth root of the tolerance from 1e-6 on, as
/// later steps do. Steps grow at most fivefold, so a short first one would cost loose tolerances two more.
double first_step(double tolerance) { return 0.05 * std::max(1.0, std::pow(1e6 * tolerance, 0.2)); }

/// Factor from a step with this error to the next one, with errors of that order.
double step_factor(double error, double order) {
  return std::isfinite(error) ? std::clamp(0.9 * std::pow(error, -1.0 / order), 0.2, 5.0) : 0.2;
}

/// Order of the errors of the attempts rejected in a row. Behind a jump of the loads it is far below that of the
/// method, as long as steps exceed the time in which the fast modes decay (Gustafsson 1994, ACM TOMS 20, 496).
class RejectionOrder {
 public:
  explicit RejectionOrder(double of_method) : of_method_(of_method) {}

  /// Returns the order that this rejection and the one before it show, at most that of the method.
  double after(double step, double error) {
    const double shown = std::log(error / error_) / std::log(step / step_);
    step_ = step, error_ = error;
    return shown > 0.0 && shown < of_method_ ? std::max(shown, kLeast) : of_method_;
  }

  void forget() { step_ = error_ = 0.0; }

 private:
  static constexpr double kLeast = 0.2;  // factors are at least 0.2, so lower orders need no account

  double of_method_;
  double step_ = 0.0, error_ = 0.0;  // 0: there is none before, and `shown` is not a number
};

struct StepChoice {
  double step = 0.0;     // s
  bool last = false;     // it reaches the communication point
  bool crosses = false;  // it ends beyond the communication point
};

/// Chooses the next step, with `rest` [s] to the communication point and `natural` [s] the step that the error allows.
StepChoice choose_step(const Rod& rod, double rest, double natural, bool may_cross) {
  if (may_cross) {
    const double crossing = std::min(natural, kMaxCrossing / rod.first_frequency());
    if (crossing > kMinCrossing * rest) return {crossing, true, true};
  }
  if (kMaxStretch * natural >= rest) return {rest, true, false};
  return {natural};
}

template <class Tableau>
StepOutcome step_adaptive(const Rod& rod, const Inputs& u, double h, double tolerance, State& state, Scratch& scratch) {
  if (!(state.time_ahead > 0.0 && std::isfinite(state.time_ahead))) state.time_ahead = 0.0;
  const InputCourse inputs = record_inputs(u, state);
  const bool may_cross = inputs.are_as_before;
  if (!may_cross) state.time_ahead = 0.0;
  double done = 0.0;
  if (h < state.time_ahead) {
    interpolate_to(rod, h, state);
    return {h, {}};
  }
  if (state.time_ahead > 0.0) {
    done = state.time_ahead;
    state.assign(state.ahead);
    state.time_ahead = 0.0;
    if (done == h) return {h, {}};
  }
  if (core::Status status = rod.check_strains(state.q.data()); !status.is_ok()) return {done, std::move(status)};
  Loads loads = loads_at(u, done);
  if (core::Status status = start_step(rod, loads, tolerance, state, scratch); !status.is_ok())
    return {done, std::move(status)};
  if (!(state.next_step > 0.0 && std::isfinite(state.next_step)))
    state.next_step = first_step(tolerance) / rod.first_frequency();
  const double min_step = kMinStep * std::min(h, 1.0 / rod.first_frequency());
  const double max_attempts = max_internal_steps(rod, h);
  RosenbrockStep<Tableau> attempt(rod, u, inputs.are_constant, state, scratch);
  RejectionOrder rejections(Tableau::kOrder);
  for (int attempts = 0; done < h; ++attempts) {
    if (attempts > max_attempts || done + state.next_step == done ||
        (attempts > kTrialAttempts && done * max_attempts < 0.1 * h * attempts))
      return {done,
              core::Status::discard("too many internal time steps", "the tolerance may be too tight for this motion")};
    const double rest = h - done;
    const auto [step, last, crosses] = choose_step(rod, rest, state.next_step, may_cross);
    attempt.compute(done, step, loads);
    const double error = attempt.error_norm(tolerance);
    const Point& solution = attempt.solution();
    if (!(error <= 1.0 && rod.is_admissible(solution.q.data()))) {
      state.next_step = step * std::min(step_factor(error, rejections.after(step, error)), 0.9);
      if (state.next_step < min_step) {
        if (core::Status status = rod.check_strains(solution.q.data()); !status.is_ok() && error <= 1.0)
          return {done, std::move(status)};
        return {done, core::Status::discard("the internal time step fell below the least one",
                                            "the loads may be too violent")};
      }
      continue;
    }
    rejections.forget();
    const double factor = step_factor(error, Tableau::kOrder);
    // A step cut short by the end of the interval says little about the next one.
    if (!last || step == state.next_step || factor < 1.0 || step * factor > state.next_step)
      state.next_step = step * factor;
    MotionState& reached = crosses ? state.ahead : state;
    reached.dissipated = state.dissipated + solution.e;
    reached.q = solution.q, reached.v = solution.v, reached.a = solution.a;
    if (crosses) {
      state.time_ahead = step;
      interpolate_to(rod, rest, state);
    }
    done = last ? h : done + step;
    if (done < h) {
      if (!inputs.are_constant) loads = loads_at(u, done);
      rod.residual(state.q.data(), state.v.data(), state.a.data(), loads, scratch.newton.work, scratch.r);
    }
  }
  return {h, {}};
}

}  // namespace

StepOutcome step_rosenbrock(const Rod& rod, const Inputs& u, double h, double tolerance, State& state,
                            Scratch& scratch) {
  return step_adaptive<Rodas5p>(rod, u, h, tolerance, state, scratch);
}

StepOutcome step_rosenbrock_3(const Rod& rod, const Inputs& u, double h, double tolerance, State& state,
                              Scratch& scratch) {
  return step_adaptive<Rodas3>(rod, u, h, tolerance, state, scratch);
}

}  // namespace rod
