// One run in step with the clock: every step begins when it is due, and what it takes is measured.
#include <algorithm>
#include <chrono>
#include <ctime>
#include <exception>
#include <limits>
#include <thread>

#include "engine/engine.h"
#include "engine/pacing.hpp"
#include "engine/run.hpp"
#include "engine/watch.hpp"

#ifdef __linux__
#include <dlfcn.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#endif

namespace {

using Clock = std::chrono::steady_clock;
using Count = unsigned long (*)();

double seconds(Clock::duration time) { return std::chrono::duration<double>(time).count(); }

// Number of allocations of this thread so far, by counting.cpp where it was loaded before the C library; 0 elsewhere.
Count allocation_counter() {
#ifdef __linux__
  if (void* counter = dlsym(RTLD_DEFAULT, "tca_allocations")) return reinterpret_cast<Count>(counter);
#endif
  return nullptr;
}

// Time that this thread has had a core [s]; without what a host took from a virtual one, where the kernel accounts for
// that (PARAVIRT_TIME_ACCOUNTING). Nan: no such clock.
double thread_time() {
#ifdef CLOCK_THREAD_CPUTIME_ID
  timespec now{};
  if (clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now) == 0)
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
#endif
  return std::numeric_limits<double>::quiet_NaN();
}

constexpr size_t rehearsed = 3;  // steps: as many samples as the polynomials of inputs go through

void wait_until(Clock::time_point due, Clock::duration period) {
  const auto now = Clock::now();
  if (const auto wake = engine::wake_time(now, due, period); wake > now) std::this_thread::sleep_until(wake);
  while (Clock::now() < due) {
  }
}

// Memory that is never paged out, a priority above all ordinary threads, and one core, where the system grants them.
// The last core: interrupts go to the first ones.
void prepare_thread(TcaTimes& times) {
  times.locked = times.scheduled = 0;
  times.core = -1;
#ifdef __linux__
  times.locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  sched_param priority{};
  priority.sched_priority = sched_get_priority_max(SCHED_FIFO) / 2;
  times.scheduled = pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority) == 0;
  cpu_set_t allowed, one;
  CPU_ZERO(&one);
  if (pthread_getaffinity_np(pthread_self(), sizeof allowed, &allowed) == 0) {
    int last = CPU_SETSIZE - 1;
    while (last > 0 && !CPU_ISSET(last, &allowed)) --last;
    CPU_SET(last, &one);
    if (pthread_setaffinity_np(pthread_self(), sizeof one, &one) == 0) times.core = last;
  }
#endif
}

// Work that no data change: a chain of multiplications. Returns what it takes [s].
double work(size_t multiplications) {
  const auto begin = Clock::now();
  volatile double product = 1.0;
  for (size_t k = 0; k < multiplications; ++k) product = product * 1.000000001;
  return seconds(Clock::now() - begin);
}

// Time of one multiplication of work() [s].
double time_of_one() {
  constexpr size_t trial = 10000;
  constexpr int trials = 20;  // of which the fastest counts
  double fastest = work(trial);
  for (int k = 1; k < trials; ++k) fastest = std::min(fastest, work(trial));
  return fastest / trial;
}

void pace(const TcaPlan& plan, engine::Run& run, double* outputs, double* durations, double* busy, double* fixed,
          TcaTimes& times, TcaWatch& watch, std::string& failure) {
  constexpr double room = 3.0;     // least rest of the period, in lengths of the fixed work
  constexpr size_t measured = 16;  // first steps, whose mean is the length of the fixed work
  prepare_thread(times);
  if (!run.rehearse(std::min(plan.steps, rehearsed))) {
    failure = run.failure();
    return;
  }
  const double each = times.period > 0.0 ? time_of_one() : 1.0;
  double typical = 0.0;
  const Count count = allocation_counter();
  const auto period = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(times.period));
  const auto start = Clock::now() + period;
  double own_end = 0.0;  // of the step before [s after `start`], had the thread had its core all the time
  for (size_t k = 0; k < plan.steps && !engine::is_stopped(watch); ++k) {
    const auto due = start + static_cast<Clock::rep>(k) * period;
    if (times.period > 0.0) wait_until(due, period);
    const unsigned long before = count ? count() : 0;
    const auto begin = Clock::now();
    const double busy_before = thread_time();
    if (!run.step(k, outputs + (k + 1) * run.width())) {
      failure = run.failure();
      break;
    }
    busy[k] = thread_time() - busy_before;
    times.sweeps = std::max(times.sweeps, run.sweeps());
    const auto end = Clock::now();
    ++times.steps;
    engine::count_done(watch);
    times.allocations += count ? count() - before : 0;
    durations[k] = seconds(end - begin);
    times.worst = std::max(times.worst, durations[k]);
    fixed[k] = std::numeric_limits<double>::quiet_NaN();
    if (times.period <= 0.0) continue;
    times.worst_lateness = std::max(times.worst_lateness, seconds(begin - due));
    if (end > due + period) ++times.misses;
    own_end = std::max(own_end, seconds(due - start)) + busy[k];
    if (own_end > seconds(due - start + period)) ++times.own_misses;
    if (k < measured)
      typical += durations[k] / measured;
    else if (seconds(due + period - end) > room * typical)
      fixed[k] = work(static_cast<size_t>(typical / each));
  }
#ifdef __linux__
  if (times.locked) munlockall();
#endif
}

}  // namespace

int tca_realtime(const TcaPlan* plan, const double* parameters, double* outputs, double* durations, double* busy,
                 double* fixed, TcaTimes* times, char* failure, char* warnings, size_t length, TcaWatch* watch) {
  std::string text, warned;
  const double period = times->period;
  *times = {};
  times->period = period;
  try {
    engine::Run run(*plan);
    if (run.begin(parameters, nullptr, outputs)) {
      std::fill_n(outputs + run.width(), plan->steps * run.width(), 0.0);  // touched, so that no step does it first
      std::thread paced([&] { pace(*plan, run, outputs, durations, busy, fixed, *times, *watch, text); });
      paced.join();
    } else {
      text = run.failure();
    }
    warned = run.warnings();
  } catch (const std::exception& error) {
    text = error.what();
  }
  engine::copy(text, failure, length);
  engine::copy(warned, warnings, length);
  return text.empty() ? 0 : -1;
}

size_t tca_plan_layout(void) {
  return (size_t{TCA_INTERFACE} << 20) + sizeof(TcaLink) + sizeof(TcaValues) + sizeof(TcaMember) + sizeof(TcaPart) +
         sizeof(TcaPlan) + sizeof(TcaTimes) + sizeof(TcaWatch);
}
