// What a long call and its caller in another thread tell each other (TcaWatch).
#pragma once

#include <atomic>

#include "engine/engine.h"

namespace engine {

inline bool is_stopped(TcaWatch& watch) { return std::atomic_ref(watch.stop).load(std::memory_order_relaxed) != 0; }

inline void count_done(TcaWatch& watch) { std::atomic_ref(watch.done).fetch_add(1, std::memory_order_relaxed); }

}  // namespace engine
