// When a thread wakes that waits for a step.
#pragma once

#include <algorithm>
#include <chrono>

namespace engine {

// Moment until which a thread sleeps that waits from `now` until `due`; from then on it waits awake. A core that sleeps
// wakes late, that of a virtual machine by milliseconds once its host has given it to others; but a kernel stops a
// thread of real-time priority that never sleeps (Linux: for 50 ms of each second). So a tenth of the period is slept,
// and what exceeds the last 2 ms.
template <class Clock>
std::chrono::time_point<Clock> wake_time(std::chrono::time_point<Clock> now, std::chrono::time_point<Clock> due,
                                         typename Clock::duration period) {
  constexpr auto awake = std::chrono::milliseconds(2);
  const bool has_time = due > now + period / 5;
  return has_time ? std::max(now + period / 10, due - awake) : now;
}

}  // namespace engine
