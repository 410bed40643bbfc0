// Step halving for fixed-step methods: the communication step in one piece, or in halves of halves where it fails.
#pragma once

#include <algorithm>
#include <cmath>

#include "integration/integrator.hpp"

namespace rod {

/// Makes steps of length h/2^k with the smallest k for which one_step(from, length) -> bool succeeds; the length grows
/// again after a success. one_step advances its state from `from` [s after the start], or fails and leaves it
/// unchanged.
template <class OneStep>
StepOutcome advance_halving(double h, OneStep&& one_step) {
  constexpr int kMaxHalvings = 12;  // the shortest step is h/4096
  double done = 0.0, length = h;
  while (done < h) {
    length = std::min(length, h - done);
    const double end = length == h - done ? h : done + length;
    if (one_step(done, length)) {
      done = end;
      length *= 2.0;
    } else {
      length *= 0.5;
      if (length <= 0.0 || length < std::ldexp(h, -kMaxHalvings) || done + length == done)
        return {done, core::Status::discard("Newton's method failed for every step length tried",
                                            "reduce the step, or the change of the inputs in it")};
    }
  }
  return {h, {}};
}

}  // namespace rod
