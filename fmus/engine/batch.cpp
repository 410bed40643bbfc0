// Many runs in one call: threads take the next run that is not done yet.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>
#include <vector>

#include "engine/engine.h"
#include "engine/run.hpp"
#include "engine/watch.hpp"

int tca_batch(const TcaPlan* plan, size_t runs, size_t columns, const double* parameters, const double* inputs,
              double* outputs, size_t threads, char* failures, char* warnings, size_t length, TcaWatch* watch) {
  std::atomic<size_t> next{0};
  std::atomic<int> failed{0};
  std::mutex mutex;
  std::string broken;  // why instances cannot be made
  for (size_t k = 0; k < runs; ++k) failures[k * length] = warnings[k * length] = '\0';

  const auto work = [&] {
    try {
      engine::Run run(*plan);
      const size_t rows = (plan->steps + 1) * run.width();
      for (size_t k = next++; k < runs; k = next++) {
        double* row = outputs + k * rows;
        const double* own = inputs ? inputs + k * plan->steps * plan->driven : nullptr;
        bool stopped = engine::is_stopped(*watch), good = !stopped && run.begin(parameters + k * columns, own, row);
        for (size_t step = 0; good && !stopped && step < plan->steps; ++step) {
          good = run.step(step, row += run.width());
          stopped = engine::is_stopped(*watch);
        }
        engine::copy(run.warnings(), warnings + k * length, length);
        engine::count_done(*watch);
        if (good && !stopped) continue;
        ++failed;
        std::fill_n(outputs + k * rows, rows, std::numeric_limits<double>::quiet_NaN());
        engine::copy(stopped ? "stopped" : run.failure(), failures + k * length, length);
      }
    } catch (const std::exception& error) {
      const std::lock_guard lock(mutex);
      broken = error.what();
    }
  };
  std::vector<std::thread> others;
  for (size_t k = 1; k < std::min(threads, runs); ++k) others.emplace_back(work);
  work();
  for (std::thread& other : others) other.join();
  if (broken.empty()) return failed;
  if (runs) engine::copy(broken, failures, length);
  return -1;
}
