// Rosenbrock methods (rosenbrock_pairs.hpp) for systems of index 1. The rod is one: q. = v, v. = a, 0 = r(q, v, a, t).
// Eliminating the first two rows of every stage leaves one matrix, r_q + g r_v + g^2 r_a with g = 1/(gamma h), factored
// once per step: no iteration, so nothing to converge and no history to lose in a rollback.
#include <array>
#include <cmath>

#include "integration/look_ahead.hpp"
#include "integration/rosenbrock_tableaus.hpp"

namespace rod {

namespace {

constexpr double strain_scale = 0.1;  // strains below this are held to an absolute error
// Of attempts in one call: more than a motion that means something needs, for every radian of the first mode.
constexpr double most_attempts = 2e4, most_attempts_per_radian = 5e3;
constexpr double worth_passing = 1.1;     // a step that long against the time to the communication point crosses it
constexpr double longest_passing = 10.0;  // radians of the first mode: on longer ways the rounding of rates would show
constexpr double stretch = 1.05;     // of a step that then comes to the communication point; its error still passes
constexpr double least_step = 1e-9;  // of the step asked for, or of the rod's time scale

/// Point (q, v, a) and increments of one stage; e is the damping's heat, integrated along.
struct Point {
  Vector q, v, a;
  double e = 0.0;
};

struct Step {
  std::array<Point, most_stages> U;
  Point y;
  Vector r, r_t, b1, b2, dr;
};

void add(Point& y, double factor, const Point& U) {
  y.q += factor * U.q;
  y.v += factor * U.v;
  y.a += factor * U.a;
  y.e += factor * U.e;
}

/// One step from the state into s.y, with the error in the last of s.U. `start` and `start_r` are work and residual at
/// the state.
template <class Pair>
void take(const Rod& rod, const Inputs& u, double from, double h, const State& state, const Work& start,
          const Vector& start_r, const Loads& loads, Eigen::PartialPivLU<Matrix>& lu, Matrix& J, Work& work, Step& s) {
  const double g = 1.0 / (Pair::gamma * h);
  rod.tangent(start, {1.0, g, g * g}, J);
  lu.compute(J);
  rod.load_derivative(start, loads, load_rates_at(u, from), s.r_t);
  const auto& D = rod.damping();
  const Vector heat_slope = 2.0 * D.cwiseProduct(state.v);

  for (int i = 0; i < Pair::stages; ++i) {
    if (i < Pair::direct) {
      s.y.q = state.q, s.y.v = state.v, s.y.a = state.a, s.y.e = 0.0;
      for (int j = 0; j < i; ++j) add(s.y, Pair::A[i - 1][j], s.U[j]);
    } else {
      add(s.y, 1.0, s.U[i - 1]);
    }
    s.b1 = s.y.v;
    s.b2 = s.y.a;
    double b_e = D.dot(s.y.v.cwiseAbs2());
    for (int j = 0; j < i; ++j) {
      s.b1 += (Pair::C[i - 1][j] / h) * s.U[j].q;
      s.b2 += (Pair::C[i - 1][j] / h) * s.U[j].v;
      b_e += (Pair::C[i - 1][j] / h) * s.U[j].e;
    }
    if (i < Pair::shared)
      s.r = start_r;
    else
      rod.residual(s.y.q.data(), s.y.v.data(), s.y.a.data(), loads_at(u, from + Pair::node[i] * h), work, s.r);
    s.dr = g * s.b1 + s.b2;
    rod.rate_derivative(start, s.b1, s.dr, s.U[i].q);
    s.r = s.U[i].q - s.r - (h * Pair::time_weight[i]) * s.r_t;
    s.U[i].q = lu.solve(s.r);
    s.U[i].v = g * s.U[i].q - s.b1;
    s.U[i].a = g * s.U[i].v - s.b2;
    s.U[i].e = (b_e + heat_slope.dot(s.U[i].v)) / g;
  }
  add(s.y, 1.0, s.U[Pair::stages - 1]);
}

/// Root mean square over strains and rates of error/(tolerance * size), sizes common to each kind.
double error_norm(const Rod& rod, double tolerance, const State& state, const Step& s, const Point& error) {
  const double q_size = strain_scale + std::max(state.q.lpNorm<Eigen::Infinity>(), s.y.q.lpNorm<Eigen::Infinity>());
  const double v_size =
      rod.first_frequency() * q_size + std::max(state.v.lpNorm<Eigen::Infinity>(), s.y.v.lpNorm<Eigen::Infinity>());
  const double sum = error.q.squaredNorm() / (q_size * q_size) + error.v.squaredNorm() / (v_size * v_size);
  return std::sqrt(sum / (2.0 * rod.unknowns())) / tolerance;
}

/// Residual at the state, with an acceleration that belongs to the loads: inputs may have jumped, and the first stages
/// would lose their order. False: there is none.
bool begin(const Rod& rod, const Loads& loads, double tolerance, State& state, Scratch& scratch) {
  const auto look = [&] {
    rod.residual(state.q.data(), state.v.data(), state.a.data(), loads, scratch.newton.work, scratch.r);
  };
  look();
  const double imbalance = (scratch.r.array() / rod.stiffness().array()).abs().maxCoeff();
  if (imbalance < tolerance * strain_scale) return true;
  if (!accelerate(rod, loads, state, scratch)) return false;
  look();
  return true;
}

struct Plan {
  double step = 0.0;                  // s
  bool last = false, passes = false;  // it comes to the communication point, or past it
};

/// The next step, with `rest` [s] to the communication point.
Plan plan(const Rod& rod, double rest, double natural, bool may_pass) {
  if (may_pass) {
    const double passing = std::min(natural, longest_passing / rod.first_frequency());
    if (passing > worth_passing * rest) return {passing, true, true};
  }
  if (stretch * natural >= rest) return {rest, true, false};
  return {natural};
}

template <class Pair>
Advance step_pair(const Rod& rod, const Inputs& u, double h, double tolerance, State& state, Scratch& scratch) {
  const bool may_pass = stand_still(u, state);
  if (!may_pass) state.left = 0.0;
  double done = 0.0;
  if (h < state.left) {
    move_towards(rod, h, state);
    return {h, ""};
  }
  if (state.left > 0.0) {
    done = state.left;
    state.assign(state.ahead);
    state.left = 0.0;
    if (done == h) return {h, ""};
  }
  Loads loads = loads_at(u, done);
  if (!begin(rod, loads, tolerance, state, scratch)) return {done, "no finite acceleration at the start of the step"};
  if (state.next_step <= 0.0) state.next_step = 0.05 / rod.first_frequency();
  const double least = least_step * std::min(h, 1.0 / rod.first_frequency());
  Work& start = scratch.newton.work;
  Step s;
  Matrix J;
  Eigen::PartialPivLU<Matrix> lu;
  for (int attempts = 0; done < h; ++attempts) {
    if (attempts > most_attempts + most_attempts_per_radian * h * rod.first_frequency())
      return {done, "too many time steps; the tolerance may be too tight for this motion"};
    const double rest = h - done;
    const auto [step, last, passes] = plan(rod, rest, state.next_step, may_pass);
    take<Pair>(rod, u, done, step, state, start, scratch.r, loads, lu, J, scratch.work, s);
    const double error = error_norm(rod, tolerance, state, s, s.U[Pair::stages - 1]);
    const double factor = std::isfinite(error) ? std::clamp(0.9 * std::pow(error, -1.0 / Pair::order), 0.2, 5.0) : 0.2;
    if (!(error <= 1.0 && s.y.q.lpNorm<Eigen::Infinity>() < wildest_strain)) {
      state.next_step = step * std::min(factor, 0.9);
      if (state.next_step < least)
        return {done, "the time step fell below the least one; the loads may be too violent"};
      continue;
    }
    // A step cut short by the end of the interval says little about the next one.
    if (!last || step == state.next_step || factor < 1.0 || step * factor > state.next_step)
      state.next_step = step * factor;
    Moment& reached = passes ? state.ahead : state;
    reached.dissipated = state.dissipated + s.y.e;
    reached.q = s.y.q, reached.v = s.y.v, reached.a = s.y.a;
    if (passes) {
      state.left = step;
      move_towards(rod, rest, state);
    }
    done = last ? h : done + step;
    if (done < h) {
      loads = loads_at(u, done);
      rod.residual(state.q.data(), state.v.data(), state.a.data(), loads, start, scratch.r);
    }
  }
  return {h, ""};
}

}  // namespace

Advance step_rosenbrock(const Rod& rod, const Inputs& u, double h, double tolerance, State& state, Scratch& scratch) {
  return step_pair<Rodas5p>(rod, u, h, tolerance, state, scratch);
}

Advance step_rosenbrock_3(const Rod& rod, const Inputs& u, double h, double tolerance, State& state, Scratch& scratch) {
  return step_pair<Rodas3>(rod, u, h, tolerance, state, scratch);
}

}  // namespace rod
