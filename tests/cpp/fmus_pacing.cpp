// When a thread wakes that waits for a step in real time.
#include <gtest/gtest.h>

#include <utility>

#include "engine/pacing.hpp"

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

// Time asleep of a thread that waits for `left`, then time awake.
std::pair<Clock::duration, Clock::duration> wait(Clock::duration left, Clock::duration period) {
  const Clock::time_point now{1h};
  const auto wake = engine::wake_time(now, now + left, period);
  return {wake - now, now + left - wake};
}

TEST(Pacing, SleepsATenthOfAShortPeriod) {
  EXPECT_EQ(wait(900us, 1ms), std::pair(100us + 0ns, 800us + 0ns));
  EXPECT_EQ(wait(2ms, 2ms), std::pair(200us + 0ns, 1800us + 0ns));
}

TEST(Pacing, IsAwakeForTheLastTwoMilliseconds) {
  EXPECT_EQ(wait(39ms, 40ms), std::pair(37ms + 0ns, 2ms + 0ns));
  EXPECT_EQ(wait(10s, 10s), std::pair(9998ms + 0ns, 2ms + 0ns));
}

TEST(Pacing, NeverSleepsWhenLittleIsLeft) {
  for (const auto left : {200us, 100us, 0us, -300us}) EXPECT_EQ(wait(left, 1ms).first, 0ns) << left.count();
  EXPECT_EQ(wait(3ms, 0ms).first, 1ms);  // as fast as it can: only a due time in the future is waited for
}

TEST(Pacing, EndsBeforeTheStepIsDue) {
  for (auto period = 1us; period < 10s; period = period * 3 + 1us)
    for (int share = 1; share <= 20; ++share) {
      const auto left = period * share / 20;
      const auto [asleep, awake] = wait(left, period);
      EXPECT_GE(asleep, 0ns);
      EXPECT_GE(awake, 0ns);
      EXPECT_LE(awake, std::max<Clock::duration>(2ms, period / 5));
    }
}

}  // namespace
