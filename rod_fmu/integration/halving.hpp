// Fixed-step methods: the step asked for, halved where it cannot be made.
#pragma once

#include <algorithm>
#include <cmath>

#include "integration/integrator.hpp"

namespace rod {

/// Steps of length h/2^k with the smallest k that one_step(from, length) -> bool allows, growing again behind a hard
/// spot. one_step advances its state from `from` [s after the start], or fails and leaves it as it was.
template <class OneStep>
Advance advance_halving(double h, OneStep&& one_step) {
  constexpr int most_halvings = 12;
  double done = 0.0, length = h;
  while (done < h) {
    length = std::min(length, h - done);
    const double end = length == h - done ? h : done + length;
    if (one_step(done, length)) {
      done = end;
      length *= 2.0;
    } else {
      length *= 0.5;
      if (length < std::ldexp(h, -most_halvings)) return {done, "Newton's method failed for every step length tried"};
    }
  }
  return {h, ""};
}

}  // namespace rod
