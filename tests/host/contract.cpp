// contract BINARY modelDescription.xml SEED CALLS [THREADS]: random calls of all 44 functions of FMI 2.0, legal and
// illegal, with good and bad arguments, and damaged serialised states, against the standard's state machines (2.0.4,
// tables of sections 3.2.3 and 4.2.4). Prints what was counted; exit code 1 on the first deviation, with the seed.
//
// Held to: a call that its state does not allow, or with arguments that no state allows, returns fmi2Error, logs one
// message and leaves the instance as it was, to the last bit; no value that is not finite leaves with fmi2OK; a
// restored state repeats a step bitwise; damaged bytes are refused, and forged ones (whose checksum is made to fit)
// are refused or behave.
#include <cstdint>
#include <cstdio>
#include <thread>

#include "walk.hpp"

using host::Counts;
using host::Description;
using host::Library;
using host::Walk;

int main(int count, char** arguments) try {
  if (count < 5) throw std::runtime_error("usage: contract BINARY modelDescription.xml SEED CALLS [THREADS]");
  const Library fmu(arguments[1]);
  const Description description(arguments[2]);
  const std::uint64_t seed = std::stoull(arguments[3]);
  const long calls = std::stol(arguments[4]);
  const std::size_t threads = count > 5 ? std::stoull(arguments[5]) : 2;  // at least one of each interface
  std::vector<Counts> counts(threads);
  std::vector<std::string> failures(threads);
  {
    std::vector<std::jthread> walkers;
    for (std::size_t k = 0; k < threads; ++k)
      walkers.emplace_back([&, k] {
        try {
          Walk walk(fmu, description, seed + k);
          walk.run(calls);
          counts[k] = walk.counts;
        } catch (const std::exception& failure) {
          failures[k] = failure.what();
        }
      });
  }
  Counts sum;
  for (const Counts& each : counts) {
    sum.calls += each.calls, sum.illegal += each.illegal, sum.bad += each.bad, sum.discards += each.discards;
    sum.errors += each.errors, sum.blobs += each.blobs, sum.accepted += each.accepted, sum.repeats += each.repeats;
  }
  std::printf(
      "%ld calls: %ld illegal, %ld with bad arguments, all refused; %ld discards, %ld errors; %ld damaged or "
      "forged states, %ld of them accepted and harmless; %ld steps repeated bitwise\n",
      sum.calls, sum.illegal, sum.bad, sum.discards, sum.errors, sum.blobs, sum.accepted, sum.repeats);
  for (std::size_t k = 0; k < threads; ++k)
    if (!failures[k].empty()) throw std::runtime_error("seed " + std::to_string(seed + k) + ": " + failures[k]);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
