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

/// State of the runtime itself; times in seconds.
struct Progress {
  Interface interface = Interface::co_simulation;
  Mode mode = Mode::instantiated;
  bool is_initialised = false;  // memory() is the start for the present parameters and inputs, or what became of it
  bool is_evaluated = false;    // the outputs belong to memory() and the inputs
  unsigned parts = 0;           // so do those of these parts (Variable::part)
  double time = 0.0;
  double start = 0.0;  // of the experiment
  double stop = std::numeric_limits<double>::infinity();
  std::uint64_t steps = 0;
  double last_step = 0.0;            // length of the last step
  std::uint32_t warnings_given = 0;  // see Model::warn_once
  bool is_tolerance_set = false;     // the host set the parameter itself: fmi2SetupExperiment does not change it
};

struct Snapshot {
  Progress progress;
  std::vector<std::byte> data;     // Model::data()
  std::vector<double> built_with;  // all parameters when build() was last called; empty: never. Memory belongs to these
  std::vector<double> memory;      // Model::memory(); empty unless is_initialised
  std::vector<double> input_rates;  // of each input at the end of the last step [unit/s]; empty: all 0
  bool is_foreign = false;          // came as bytes: its memory is checked before it is restored
};

/// Number of bytes that serialise() writes.
std::size_t serialised_size(const Blueprint& blueprint, const Snapshot& snapshot);

/// Little-endian words of 8 bytes, without pointers or padding: magic, version, length, table, progress, parameters and
/// inputs, built_with, memory, input_rates, checksum. Outputs are left out: they follow from the rest.
void serialise(const Blueprint& blueprint, const Snapshot& snapshot, std::span<std::byte> bytes);

/// The inverse; `data` is any data struct of the model, whose outputs remain. Throws Error when the bytes are damaged,
/// of another version or of another FMU, or hold what no instance can be in, whatever their checksum.
Snapshot deserialise(const Blueprint& blueprint, std::span<const std::byte> bytes, std::span<const std::byte> data);

}  // namespace fmu
