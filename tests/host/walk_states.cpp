// Calls that save and restore states: repeated steps, damaged and forged bytes.
#include <cmath>
#include <cstring>

#include "walk.hpp"

namespace host {

namespace {

std::uint64_t checksum(const std::vector<char>& bytes, std::size_t count) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (std::size_t i = 0; i < count; ++i) hash = (hash ^ static_cast<unsigned char>(bytes[i])) * 0x100000001b3u;
  return hash;
}

}  // namespace

fmi2Status Walk::save() {
  fmi2FMUstate state = nullptr;
  return is_bad_ ? fmu_.GetFMUstate(instance_, nullptr) : with_state(fmu_.GetFMUstate(instance_, &state), state);
}

fmi2Status Walk::with_state(fmi2Status status, fmi2FMUstate state) {
  if (status <= fmi2Warning) expect(fmu_.FreeFMUstate(instance_, &state) == fmi2OK && !state, "a state stays");
  return status;
}

fmi2Status Walk::free_state() {
  fmi2FMUstate foreign = this;
  return is_bad_ ? fmu_.FreeFMUstate(instance_, &foreign) : fmu_.FreeFMUstate(instance_, nullptr);
}

fmi2Status Walk::restore() {
  if (is_bad_) return fmu_.SetFMUstate(instance_, this);
  fmi2FMUstate state = nullptr;
  fmi2Status status = fmu_.GetFMUstate(instance_, &state);
  if (status > fmi2Warning) return status;
  std::vector<double> values[2];
  if (is_slave_ && mode_ == running) {
    const double h = uniform(1e-4, 1e-2);
    for (std::vector<double>& seen : values) {
      seen.push_back(fmu_.DoStep(instance_, time_, h, fmi2True));
      for (const Variable* v : outputs_) {
        double value = 0.0;
        if (fmu_.GetReal(instance_, &v->reference, 1, &value) <= fmi2Warning) seen.push_back(value);
      }
      expect(fmu_.SetFMUstate(instance_, state) == fmi2OK, "a state cannot be restored");
    }
    ++counts.repeats;
    expect(values[0].size() == values[1].size() &&
               std::memcmp(values[0].data(), values[1].data(), values[0].size() * sizeof(double)) == 0,
           "a repeated step differs");
  } else {
    status = fmu_.SetFMUstate(instance_, state);
  }
  return with_state(status, state);
}

fmi2Status Walk::size_of_state() {
  std::size_t size = 0;
  return fmu_.SerializedFMUstateSize(instance_, this, &size);
}

fmi2Status Walk::serialise() {
  char byte = 0;
  return fmu_.SerializeFMUstate(instance_, this, &byte, 1);
}

fmi2Status Walk::deserialise() {
  std::vector<char> blob = bytes();
  const std::vector<char> good = blob;
  const std::size_t words = blob.size() / 8;
  const int kind = static_cast<int>(pick(3));
  if (is_bad_ || kind == 0) {
    blob[pick(blob.size())] ^= static_cast<char>(1 << pick(8));
  } else if (kind == 1) {
    blob.resize(pick(blob.size()));
    blob.reserve(1);
  } else {
    constexpr double kNumbers[] = {1e9, -1.0, 1e300, -1e300, 0.0, 1e-300, 3.5, 7.0};
    for (std::size_t k = 1 + pick(3); k > 0; --k) {
      const std::size_t at = 8 * (2 + pick(words - 3));
      const double value = chance(0.1) ? std::nan("") : kNumbers[pick(std::size(kNumbers))];
      const std::uint64_t word = pick(12);
      if (chance(0.7))
        std::memcpy(&blob[at], &value, 8);
      else
        std::memcpy(&blob[at], &word, 8);
    }
    const std::uint64_t sum = checksum(blob, blob.size() - 8);
    std::memcpy(&blob[blob.size() - 8], &sum, 8);
  }
  ++counts.blobs;
  fmi2FMUstate state = nullptr;
  const fmi2Status status = fmu_.DeSerializeFMUstate(instance_, blob.data(), blob.size(), &state);
  if (blob == good || kind < 2 || is_bad_) {
    if (blob != good) expect(status == fmi2Error, "damaged bytes are accepted");
    return status;
  }
  if (status > fmi2Warning) return fmi2OK;
  ++counts.accepted;
  if (fmu_.SetFMUstate(instance_, state) <= fmi2Warning) behave();
  expect(fmu_.FreeFMUstate(instance_, &state) == fmi2OK, "a state stays");
  expect(fmu_.DeSerializeFMUstate(instance_, good.data(), good.size(), &state) == fmi2OK, "good bytes are refused");
  expect(fmu_.SetFMUstate(instance_, state) == fmi2OK, "a good state cannot be restored");
  return with_state(fmi2OK, state);
}

void Walk::behave() {
  double reached = 0.0;
  if (fmu_.GetRealStatus(instance_, fmi2LastSuccessfulTime, &reached) == fmi2OK)
    fmu_.DoStep(instance_, reached, 1e-3, fmi2True);
  for (const Variable* v : reals_) {
    double value = 0.0;
    if (fmu_.GetReal(instance_, &v->reference, 1, &value) <= fmi2Warning)
      expect(std::isfinite(value), "a forged state leads to a value that is not finite");
  }
}

}  // namespace host
