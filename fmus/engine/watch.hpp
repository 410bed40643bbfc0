// What a long call tells its caller: while it runs, from another thread (TcaWatch), and as texts at its end.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstring>
#include <string>

#include "engine/engine.h"

namespace engine {

inline bool is_stopped(TcaWatch& watch) { return std::atomic_ref(watch.stop).load(std::memory_order_relaxed) != 0; }

inline void count_done(TcaWatch& watch) { std::atomic_ref(watch.done).fetch_add(1, std::memory_order_relaxed); }

// Writes a text into memory of that length, shorter where it does not fit.
inline void copy(const std::string& text, char* into, size_t length) {
  const size_t size = std::min(text.size(), length - 1);
  std::memcpy(into, text.data(), size);
  into[size] = '\0';
}

}  // namespace engine
