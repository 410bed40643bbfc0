// The whole state of an instance at one moment, and its form as bytes that mean the same in another process.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "description/blueprint.hpp"
#include "runtime/allowed_calls.hpp"

namespace fmu {

/// What the runtime itself remembers; times in seconds.
struct Progress {
  Interface interface = Interface::co_simulation;
  Mode mode = Mode::instantiated;
  bool is_initialised = false;  // memory() is the start for the present parameters and inputs, or what became of it
  bool is_evaluated = false;    // the outputs belong to memory() and the inputs
  double time = 0.0;
  double stop = std::numeric_limits<double>::infinity();
  std::uint64_t steps = 0;
};

struct Snapshot {
  Progress progress;
  std::vector<std::byte> data;     // Model::data()
  std::vector<double> built_with;  // all parameters when build() was last called; empty: never. Memory belongs to these
  std::vector<double> memory;      // Model::memory(); empty unless is_initialised
};

/// Number of bytes that serialise() writes.
std::size_t serialised_size(const Blueprint& blueprint, const Snapshot& snapshot);

/// Little-endian words of 8 bytes, without pointers or padding: magic, version, length, table, progress, parameters and
/// inputs, built_with, memory, checksum. Outputs are left out: they follow from the rest.
void serialise(const Blueprint& blueprint, const Snapshot& snapshot, std::span<std::byte> bytes);

/// The inverse; `data` is any data struct of the model, whose outputs remain. Throws Error when the bytes are damaged,
/// of another version or of another FMU.
Snapshot deserialise(const Blueprint& blueprint, std::span<const std::byte> bytes, std::span<const std::byte> data);

}  // namespace fmu
