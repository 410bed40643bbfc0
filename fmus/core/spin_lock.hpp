#pragma once

#include <atomic>

namespace core {

/// Holds a flag while it lives. For what is rare and short; MinGW's win32 threads have no std::mutex.
class SpinLock {
 public:
  explicit SpinLock(std::atomic_flag& flag) : flag_(flag) {
    while (flag_.test_and_set(std::memory_order_acquire)) continue;
  }
  ~SpinLock() { flag_.clear(std::memory_order_release); }
  SpinLock(const SpinLock&) = delete;

 private:
  std::atomic_flag& flag_;
};

}  // namespace core
