// Quintic Hermite interpolation of the strains within an internal step.
#include "integration/dense_output.hpp"

#include <array>
#include <cstring>
#include <limits>

#include "numerics/arrays.hpp"
#include "numerics/kernel.hpp"

namespace rod {

namespace {

/// Factors of the change, rates and second rates at both ends in the polynomial, in units of the step.
struct Factors {
  double s, f0, f1, g0, g1;
};

/// Arrays of a motion.
struct Arrays {
  double *q, *v, *a;
};

template <class Value>
ROD_INLINE void interpolate_at(int k, double T, const std::array<Factors, 3>& factors, const Arrays& end,
                               const Arrays& now) {
  const auto q = load<Value>(now.q + k);
  const Value change = load<Value>(end.q + k) - q;
  const Value v0 = T * load<Value>(now.v + k), v1 = T * load<Value>(end.v + k);
  const Value a0 = T * T * load<Value>(now.a + k), a1 = T * T * load<Value>(end.a + k);
  const auto sum = [&](const Factors& f)
                       ROD_LAMBDA_INLINE { return f.s * change + f.f0 * v0 + f.f1 * v1 + f.g0 * a0 + f.g1 * a1; };
  store<Value>(now.q + k, q + sum(factors[0]));
  store<Value>(now.v + k, sum(factors[1]) / T);
  store<Value>(now.a + k, sum(factors[2]) / (T * T));
}

ROD_INLINE void interpolate(int n, double T, const std::array<Factors, 3>& factors, const Arrays& end,
                            const Arrays& now) {
  int k = 0;
  for (; k + kPackSize <= n; k += kPackSize) interpolate_at<Pack>(k, T, factors, end, now);
  for (; k < n; ++k) interpolate_at<double>(k, T, factors, end, now);
}

}  // namespace

InputCourse record_inputs(const Inputs& u, State& state) {
  if (!are_constant(u)) {
    state.loads[0] = std::numeric_limits<double>::infinity();  // no finite input equals it
    return {};
  }
  const Loads loads = loads_at(u, 0.0);
  // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): the same numbers to the last bit
  const bool same = std::memcmp(state.loads, &loads, sizeof loads) == 0;
  std::memcpy(state.loads, &loads, sizeof loads);
  return {.are_constant = true, .are_as_before = same};
}

void interpolate_to(const Rod& rod, double elapsed, State& state) {
  MotionState& end = state.ahead;
  const double T = state.time_ahead, x = elapsed / T, x2 = x * x, x3 = x2 * x, x4 = x3 * x, x5 = x4 * x;
  const auto power = [&rod](const auto& v) { return rod.damping_power(v); };
  const double from = power(state.v), to = power(end.v);
  const double heat = end.dissipated - state.dissipated;
  state.dissipated += (3.0 * x2 - 2.0 * x3) * heat + T * ((x - 2.0 * x2 + x3) * from + (x3 - x2) * to);

  // q - q0 = (q1 - q0) s + T v0 f0 + T v1 f1 + T^2 a0 g0 + T^2 a1 g1, and the first two derivatives of each factor.
  const Factors value{10.0 * x3 - 15.0 * x4 + 6.0 * x5, x - 6.0 * x3 + 8.0 * x4 - 3.0 * x5,
                      -4.0 * x3 + 7.0 * x4 - 3.0 * x5, 0.5 * (x2 - 3.0 * x3 + 3.0 * x4 - x5),
                      0.5 * (x3 - 2.0 * x4 + x5)};
  const Factors first{30.0 * x2 - 60.0 * x3 + 30.0 * x4, 1.0 - 18.0 * x2 + 32.0 * x3 - 15.0 * x4,
                      -12.0 * x2 + 28.0 * x3 - 15.0 * x4, 0.5 * (2.0 * x - 9.0 * x2 + 12.0 * x3 - 5.0 * x4),
                      0.5 * (3.0 * x2 - 8.0 * x3 + 5.0 * x4)};
  const Factors second{60.0 * x - 180.0 * x2 + 120.0 * x3, -36.0 * x + 96.0 * x2 - 60.0 * x3,
                       -24.0 * x + 84.0 * x2 - 60.0 * x3, 0.5 * (2.0 - 18.0 * x + 36.0 * x2 - 20.0 * x3),
                       0.5 * (6.0 * x - 24.0 * x2 + 20.0 * x3)};
  dispatch_exact<interpolate>(rod.unknowns(), T, std::array{value, first, second},
                              Arrays{end.q.data(), end.v.data(), end.a.data()},
                              Arrays{state.q.data(), state.v.data(), state.a.data()});
  state.time_ahead -= elapsed;
}

}  // namespace rod
