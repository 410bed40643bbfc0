// The C functions of FMI 2.0 that save and restore the state of an instance.
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "runtime/call.hpp"

using fmu::Error;
using fmu::Instance;
using fmu::need;
using fmu::run;
using fmu::Snapshot;
namespace call = fmu::call;

extern "C" {

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* FMUstate) {
  return run(c, call::get_state, [&](Instance& instance) {
    need(FMUstate);
    if (*FMUstate) return instance.save(instance.find(*FMUstate));
    auto snapshot = std::make_unique<Snapshot>();
    instance.save(*snapshot);
    *FMUstate = instance.add(std::move(snapshot));
  });
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
  return run(c, call::set_state, [&](Instance& instance) { instance.restore(instance.find(FMUstate)); });
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate* FMUstate) {
  return run(c, call::free_state, [&](Instance& instance) {
    if (!FMUstate || !*FMUstate) return;  // as the standard asks
    instance.remove(*FMUstate);
    *FMUstate = nullptr;
  });
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t* size) {
  return run(c, call::state_size, [&](Instance& instance) {
    need(size);
    *size = fmu::serialised_size(instance.blueprint(), instance.find(FMUstate));
  });
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
  return run(c, call::serialize_state, [&](Instance& instance) {
    need(serializedState);
    const Snapshot& snapshot = instance.find(FMUstate);
    if (const size_t needed = fmu::serialised_size(instance.blueprint(), snapshot); size != needed)
      throw Error("room for " + std::to_string(size) + " bytes was given, " + std::to_string(needed) +
                  " are needed; ask fmi2SerializedFMUstateSize");
    fmu::serialise(instance.blueprint(), snapshot, std::as_writable_bytes(std::span(serializedState, size)));
  });
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate* FMUstate) {
  return run(c, call::deserialize_state, [&](Instance& instance) {
    need(serializedState, FMUstate);
    Snapshot snapshot = instance.deserialise(std::as_bytes(std::span(serializedState, size)));
    if (*FMUstate)
      instance.find(*FMUstate) = std::move(snapshot);
    else
      *FMUstate = instance.add(std::make_unique<Snapshot>(std::move(snapshot)));
  });
}

}  // extern "C"
