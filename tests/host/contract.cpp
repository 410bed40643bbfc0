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
#include <cstring>
#include <functional>
#include <map>
#include <random>
#include <thread>

#include "library.hpp"

namespace {

using host::Description;
using host::Library;
using host::Variable;

enum Mode { instantiated, initialization, running, failed, event, continuous, terminated, broken };
constexpr unsigned in(Mode mode) { return 1u << mode; }
constexpr unsigned kSlave = in(running) | in(failed), kExchange = in(event) | in(continuous);
constexpr unsigned kEnd = in(terminated) | in(broken), kStart = in(instantiated) | in(initialization);
constexpr unsigned kLive = kStart | kSlave | kExchange | kEnd;
constexpr unsigned kRead = kLive & ~in(instantiated), kSet = kStart | kSlave | kExchange;
constexpr unsigned kRates = in(initialization) | kExchange | kEnd;

enum class Of { both, slave, exchange };  // interface that has a function

struct Counts {
  long calls = 0, illegal = 0, bad = 0, discards = 0, errors = 0, blobs = 0, accepted = 0, repeats = 0;
};

std::uint64_t checksum(const std::vector<char>& bytes, std::size_t count) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (std::size_t i = 0; i < count; ++i) hash = (hash ^ static_cast<unsigned char>(bytes[i])) * 0x100000001b3u;
  return hash;
}

/// One instance under random calls.
class Walk {
 public:
  Walk(const Library& fmu, const Description& description, std::uint64_t seed)
      : fmu_(fmu), about_(description), random_(seed), is_slave_(seed % 2 == 0) {
    callbacks_ = {log, std::calloc, std::free, nullptr, this};
    for (const Variable& v : about_.variables) {
      if (v.causality == "input") inputs_.push_back(&v);
      if (v.causality == "output" && v.type == "Real") outputs_.push_back(&v);
      if (v.type == "Real") reals_.push_back(&v);
    }
    create();
  }
  ~Walk() { fmu_.FreeInstance(instance_); }

  void run(long calls) {
    for (long k = 0; k < calls; ++k) {
      const auto& action = kActions[pick(kActions.size())];
      const bool is_allowed = (action.modes & in(mode_)) && action.of != (is_slave_ ? Of::exchange : Of::slave);
      // Illegal calls are tried now and then, and always when they would be told apart by nothing but the state.
      if (!is_allowed && chance(0.7)) continue;
      ++counts.calls;
      name_ = action.name;
      messages_ = 0;
      std::vector<char> before;
      const bool is_watched = !is_allowed && chance(0.2);
      if (is_watched) before = bytes();
      messages_ = 0;
      is_bad_ = is_allowed && action.has_arguments && chance(0.15);
      if (is_bad_ && chance(0.3)) before = bytes();
      messages_ = 0;
      const fmi2Status status = (this->*action.call)();
      if (!is_allowed || is_bad_) {
        ++(is_allowed ? counts.bad : counts.illegal);
        expect(status == fmi2Error, is_allowed ? "bad arguments are not refused" : "an illegal call is not refused");
        expect(messages_ == 1, "a refusal is not logged exactly once");
        if (!before.empty()) expect(bytes() == before, "a refused call changed the instance");
      } else {
        expect(status <= fmi2Error, "fatal");
        if (status == fmi2Discard) ++counts.discards;
        if (status == fmi2Error) ++counts.errors;
      }
    }
  }

  Counts counts;

 private:
  struct Action {
    const char* name;
    unsigned modes;
    bool has_arguments;
    fmi2Status (Walk::*call)();
    Of of = Of::both;
  };
  static const std::vector<Action> kActions;

  static void log(fmi2ComponentEnvironment self, fmi2String, fmi2Status, fmi2String, fmi2String text, ...) {
    ++static_cast<Walk*>(self)->messages_;
    static_cast<Walk*>(self)->last_ = text;
  }
  void expect(bool holds, const char* what) const {
    if (!holds)
      throw std::runtime_error(std::string(name_) + " in mode " + std::to_string(mode_) +
                               (is_slave_ ? " (slave): " : ": ") + what + (is_bad_ ? " [bad arguments]" : "") +
                               "; last message: " + last_);
  }
  std::size_t pick(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(random_); }
  bool chance(double p) { return std::uniform_real_distribution<double>()(random_) < p; }
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }

  void create() {
    instance_ = fmu_.Instantiate("walk", is_slave_ ? fmi2CoSimulation : fmi2ModelExchange, about_.guid.c_str(), "",
                                 &callbacks_, fmi2False, fmi2True);
    const fmi2String events = "logEvents";
    fmu_.SetDebugLogging(instance_, fmi2False, 1, &events);
    mode_ = instantiated;
  }

  std::vector<char> bytes() {
    fmi2FMUstate state = nullptr;
    std::size_t size = 0;
    expect(fmu_.GetFMUstate(instance_, &state) == fmi2OK, "a state cannot be saved");
    expect(fmu_.SerializedFMUstateSize(instance_, state, &size) == fmi2OK, "a state has no size");
    std::vector<char> result(size);
    expect(fmu_.SerializeFMUstate(instance_, state, result.data(), size) == fmi2OK, "a state cannot be serialised");
    expect(fmu_.FreeFMUstate(instance_, &state) == fmi2OK, "a state cannot be freed");
    return result;
  }

  double plausible(const Variable& v) {
    const double size = std::max(1.0, std::abs(v.start)), value = v.start + 0.1 * size * uniform(-1.0, 1.0);
    return std::min(std::max(value, v.least), v.most);
  }

  // ------------------------------------------------------------- calls; those of a bad kind must be refused
  fmi2Status debug() {
    const fmi2String good = "logStatusWarning", bad = "noSuchCategory";
    return fmu_.SetDebugLogging(instance_, fmi2True, 1, is_bad_ ? &bad : &good);
  }
  fmi2Status setup() {
    const fmi2Status status = fmu_.SetupExperiment(instance_, fmi2True, is_bad_ ? -1.0 : 1e-3, 0.0, fmi2False, 0.0);
    if (status <= fmi2Warning) time_ = 0.0;
    return status;
  }
  fmi2Status enter() { return moved(fmu_.EnterInitializationMode(instance_), instantiated, initialization); }
  fmi2Status leave() {
    return moved(fmu_.ExitInitializationMode(instance_), initialization, is_slave_ ? running : event);
  }
  fmi2Status terminate() {
    if (mode_ != terminated && chance(0.9) && (in(mode_) & (kSlave | kExchange))) return fmi2OK;  // rarely: walks go on
    return moved(fmu_.Terminate(instance_), mode_, terminated);
  }
  fmi2Status reset() {
    if (!(in(mode_)&kEnd) && chance(0.9)) return fmi2OK;
    const fmi2Status status = fmu_.Reset(instance_);
    if (status <= fmi2Warning) mode_ = instantiated, time_ = 0.0;
    return status;
  }
  fmi2Status moved(fmi2Status status, Mode from, Mode to) {
    if (status <= fmi2Warning && mode_ == from) mode_ = to;
    return status;
  }

  fmi2Status get_real() {
    fmi2ValueReference vr[2] = {reals_[pick(reals_.size())]->reference, reals_[pick(reals_.size())]->reference};
    double values[2] = {0.0, 0.0};
    if (is_bad_ && chance(0.5)) return fmu_.GetReal(instance_, vr, 2, nullptr);
    if (is_bad_) vr[1] = 1u << 20;
    const fmi2Status status = fmu_.GetReal(instance_, vr, 2, values);
    if (status <= fmi2Warning) expect(std::isfinite(values[0]) && std::isfinite(values[1]), "a value is not finite");
    return status;
  }
  template <class Function>
  fmi2Status get_other(Function function, const char* type) {
    for (const Variable& v : about_.variables) {
      if (v.type != type) continue;
      const fmi2ValueReference vr = is_bad_ ? 1u << 20 : v.reference;
      int value = 0;
      return function(instance_, &vr, 1, &value);
    }
    return is_bad_ ? function(instance_, nullptr, 1, nullptr) : function(instance_, nullptr, 0, nullptr);
  }
  fmi2Status get_integer() { return get_other(fmu_.GetInteger, "Enumeration"); }
  fmi2Status get_boolean() { return get_other(fmu_.GetBoolean, "Boolean"); }
  fmi2Status get_string() { return fmu_.GetString(instance_, nullptr, is_bad_ ? 1 : 0, nullptr); }
  fmi2Status set_string() { return fmu_.SetString(instance_, nullptr, is_bad_ ? 1 : 0, nullptr); }
  fmi2Status set_integer() { return fmu_.SetInteger(instance_, nullptr, is_bad_ ? 1 : 0, nullptr); }
  fmi2Status set_boolean() { return fmu_.SetBoolean(instance_, nullptr, is_bad_ ? 1 : 0, nullptr); }
  fmi2Status set_real() {
    const Variable& v = *inputs_[pick(inputs_.size())];
    fmi2ValueReference vr[2] = {v.reference, v.reference};
    double values[2] = {plausible(v), plausible(v)};
    if (is_bad_) {
      if (chance(0.5))
        values[1] = chance(0.5) ? std::nan("") : std::numeric_limits<double>::infinity();
      else
        vr[1] = outputs_[pick(outputs_.size())]->reference;
    }
    return fmu_.SetReal(instance_, vr, 2, values);
  }
  fmi2Status set_derivatives() {
    const fmi2ValueReference vr = inputs_[pick(inputs_.size())]->reference;
    const int order = is_bad_ ? 4 : 1 + static_cast<int>(pick(3));
    const double value = chance(0.02) ? 1e300 : uniform(-0.1, 0.1);
    return fmu_.SetRealInputDerivatives(instance_, &vr, 1, &order, &value);
  }
  fmi2Status output_derivatives() {
    const fmi2ValueReference vr = is_bad_ ? inputs_[0]->reference : outputs_[pick(outputs_.size())]->reference;
    const int order = 1 + static_cast<int>(pick(2));
    double value = 0.0;
    const fmi2Status status = fmu_.GetRealOutputDerivatives(instance_, &vr, 1, &order, &value);
    if (status <= fmi2Warning) expect(std::isfinite(value), "a derivative is not finite");
    return status;
  }
  fmi2Status directional() {
    if (!is_bad_ && (in(mode_)&kRead) && chance(0.8)) return fmi2OK;  // the dearest call
    const fmi2ValueReference unknown = outputs_[pick(outputs_.size())]->reference, known = inputs_[0]->reference;
    const fmi2ValueReference bad = 1u << 20;
    const double seed = 1.0;
    double value = 0.0;
    const fmi2Status status =
        fmu_.GetDirectionalDerivative(instance_, is_bad_ ? &bad : &unknown, 1, &known, 1, &seed, &value);
    if (status <= fmi2Warning) expect(std::isfinite(value), "a directional derivative is not finite");
    return status;
  }

  fmi2Status save() {
    fmi2FMUstate state = nullptr;
    return is_bad_ ? fmu_.GetFMUstate(instance_, nullptr) : with_state(fmu_.GetFMUstate(instance_, &state), state);
  }
  fmi2Status with_state(fmi2Status status, fmi2FMUstate state) {
    if (status <= fmi2Warning) expect(fmu_.FreeFMUstate(instance_, &state) == fmi2OK && !state, "a state stays");
    return status;
  }
  fmi2Status free_state() {
    fmi2FMUstate foreign = this;
    return is_bad_ ? fmu_.FreeFMUstate(instance_, &foreign) : fmu_.FreeFMUstate(instance_, nullptr);
  }
  /// Saves, steps, restores, steps again: the same bits.
  fmi2Status restore() {
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
  fmi2Status size_of_state() {
    std::size_t size = 0;
    return fmu_.SerializedFMUstateSize(instance_, this, &size);
  }
  fmi2Status serialise() {
    char byte = 0;
    return fmu_.SerializeFMUstate(instance_, this, &byte, 1);
  }
  /// Bytes with a flipped bit, cut short, or with numbers changed and the checksum made to fit.
  fmi2Status deserialise() {
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
  /// Whatever a forged state holds, values are finite or refused.
  void behave() {
    double reached = 0.0;
    if (fmu_.GetRealStatus(instance_, fmi2LastSuccessfulTime, &reached) == fmi2OK)
      fmu_.DoStep(instance_, reached, 1e-3, fmi2True);
    for (const Variable* v : reals_) {
      double value = 0.0;
      if (fmu_.GetReal(instance_, &v->reference, 1, &value) <= fmi2Warning)
        expect(std::isfinite(value), "a forged state leads to a value that is not finite");
    }
  }

  fmi2Status step() {
    const double h = is_bad_ ? (chance(0.5) ? -1.0 : std::nan("")) : std::pow(10.0, uniform(-4.0, -1.0));
    const fmi2Status status = fmu_.DoStep(instance_, time_, h, fmi2True);
    if (is_bad_ || !(in(mode_)&kSlave)) return status;
    double reached = 0.0;
    if (status == fmi2Error) {
      mode_ = broken;
    } else {
      mode_ = status == fmi2Discard ? failed : running;
      expect(fmu_.GetRealStatus(instance_, fmi2LastSuccessfulTime, &reached) == fmi2OK, "no last successful time");
      expect(reached >= time_ && reached <= time_ + h * (1 + 1e-9), "the last successful time is not in the step");
      time_ = reached;
    }
    return status;
  }
  fmi2Status cancel() { return fmu_.CancelStep(instance_); }
  int kind() { return static_cast<int>(pick(4)) - (chance(0.1) ? 7 : 0); }
  fmi2Status answered(fmi2Status status) {
    if (is_slave_ && (in(mode_) & (kSlave | in(terminated))))
      expect(status == fmi2OK || status == fmi2Discard, "an inquiry is neither answered nor discarded");
    return status;
  }
  /// Kinds outside of the enumeration too.
  fmi2StatusKind any_kind() {
    const int number = kind();
    fmi2StatusKind result{};
    std::memcpy(&result, &number, sizeof number);
    return result;
  }
  fmi2Status get_status() {
    fmi2Status value = fmi2OK;
    return answered(fmu_.GetStatus(instance_, any_kind(), &value));
  }
  fmi2Status get_real_status() {
    double value = 0.0;
    return answered(fmu_.GetRealStatus(instance_, any_kind(), &value));
  }
  fmi2Status get_integer_status() {
    int value = 0;
    return answered(fmu_.GetIntegerStatus(instance_, any_kind(), &value));
  }
  fmi2Status get_boolean_status() {
    int value = 0;
    return answered(fmu_.GetBooleanStatus(instance_, any_kind(), &value));
  }
  fmi2Status get_string_status() {
    fmi2String value = nullptr;
    return answered(fmu_.GetStringStatus(instance_, any_kind(), &value));
  }

  fmi2Status event_mode() {
    const fmi2Status status = fmu_.EnterEventMode(instance_);
    if (status == fmi2OK) mode_ = event;
    return status;
  }
  fmi2Status new_states() {
    fmi2EventInfo info{};
    return fmu_.NewDiscreteStates(instance_, is_bad_ ? nullptr : &info);
  }
  fmi2Status continuous_mode() { return moved(fmu_.EnterContinuousTimeMode(instance_), event, continuous); }
  fmi2Status completed() {
    fmi2Boolean a = 0, b = 0;
    return fmu_.CompletedIntegratorStep(instance_, fmi2True, is_bad_ ? nullptr : &a, &b);
  }
  fmi2Status set_time() {
    const fmi2Status status = fmu_.SetTime(instance_, is_bad_ ? std::nan("") : time_ + 1e-4);
    if (status <= fmi2Warning) time_ += 1e-4;
    return status;
  }
  std::size_t room() { return about_.states.size() + (is_bad_ ? 1 : 0); }
  fmi2Status set_states() {
    std::vector<double> x(room(), 0.0);
    for (double& each : x) each = uniform(-1e-3, 1e-3);
    if (chance(0.02)) x[0] = 1e200;
    return fmu_.SetContinuousStates(instance_, x.data(), x.size());
  }
  fmi2Status finite_numbers(fmi2Status (*function)(fmi2Component, fmi2Real*, size_t)) {
    std::vector<double> x(room(), 0.0);
    const fmi2Status status = function(instance_, x.data(), x.size());
    for (const double each : x) expect(status > fmi2Warning || std::isfinite(each), "a number is not finite");
    return status;
  }
  fmi2Status get_derivatives() { return finite_numbers(fmu_.GetDerivatives); }
  fmi2Status get_states() { return finite_numbers(fmu_.GetContinuousStates); }
  fmi2Status get_nominals() { return finite_numbers(fmu_.GetNominalsOfContinuousStates); }
  fmi2Status get_indicators() {
    double z = 0.0;
    return fmu_.GetEventIndicators(instance_, &z, is_bad_ ? 1 : 0);
  }
  fmi2Status inquire() {
    expect(std::string(fmu_.GetVersion()) == "2.0" && fmu_.GetTypesPlatform(), "no version");
    return fmi2OK;
  }
  /// Frees and instantiates, seldom.
  fmi2Status recreate() {
    if (!chance(0.01)) return fmi2OK;
    fmu_.FreeInstance(instance_);
    time_ = 0.0;
    create();
    return fmi2OK;
  }

  const Library& fmu_;
  const Description& about_;
  std::mt19937_64 random_;
  bool is_slave_;
  fmi2CallbackFunctions callbacks_{};
  fmi2Component instance_ = nullptr;
  Mode mode_ = instantiated;
  double time_ = 0.0;
  bool is_bad_ = false;
  int messages_ = 0;
  std::string last_;
  const char* name_ = "fmi2Instantiate";
  std::vector<const Variable*> inputs_, outputs_, reals_;
};

const std::vector<Walk::Action> Walk::kActions{
    {"fmi2GetVersion", ~0u, false, &Walk::inquire},
    {"fmi2Instantiate", ~0u, false, &Walk::recreate},
    {"fmi2SetDebugLogging", kLive, true, &Walk::debug},
    {"fmi2SetupExperiment", in(instantiated), true, &Walk::setup},
    {"fmi2EnterInitializationMode", in(instantiated), false, &Walk::enter},
    {"fmi2ExitInitializationMode", in(initialization), false, &Walk::leave},
    {"fmi2Terminate", kSlave | kExchange, false, &Walk::terminate},
    {"fmi2Reset", kLive, false, &Walk::reset},
    {"fmi2GetReal", kRead, true, &Walk::get_real},
    {"fmi2GetInteger", kRead, true, &Walk::get_integer},
    {"fmi2GetBoolean", kRead, true, &Walk::get_boolean},
    {"fmi2GetString", kRead, true, &Walk::get_string},
    {"fmi2SetReal", kSet, true, &Walk::set_real},
    {"fmi2SetInteger", kSet & ~in(continuous), true, &Walk::set_integer},
    {"fmi2SetBoolean", kSet & ~in(continuous), true, &Walk::set_boolean},
    {"fmi2SetString", kSet & ~in(continuous), true, &Walk::set_string},
    {"fmi2GetFMUstate", kLive, true, &Walk::save},
    {"fmi2SetFMUstate", kLive, true, &Walk::restore},
    {"fmi2FreeFMUstate", kLive, true, &Walk::free_state},
    {"fmi2SerializedFMUstateSize", 0, false, &Walk::size_of_state},
    {"fmi2SerializeFMUstate", 0, false, &Walk::serialise},
    {"fmi2DeSerializeFMUstate", kLive, false, &Walk::deserialise},
    {"fmi2GetDirectionalDerivative", kRead, true, &Walk::directional},
    {"fmi2SetRealInputDerivatives", kSet, true, &Walk::set_derivatives, Of::slave},
    {"fmi2GetRealOutputDerivatives", kSlave | kEnd, true, &Walk::output_derivatives, Of::slave},
    {"fmi2DoStep", kSlave, true, &Walk::step, Of::slave},
    {"fmi2CancelStep", 0, false, &Walk::cancel, Of::slave},
    {"fmi2GetStatus", kSlave | in(terminated), false, &Walk::get_status, Of::slave},
    {"fmi2GetRealStatus", kSlave | in(terminated), false, &Walk::get_real_status, Of::slave},
    {"fmi2GetIntegerStatus", kSlave | in(terminated), false, &Walk::get_integer_status, Of::slave},
    {"fmi2GetBooleanStatus", kSlave | in(terminated), false, &Walk::get_boolean_status, Of::slave},
    {"fmi2GetStringStatus", kSlave | in(terminated), false, &Walk::get_string_status, Of::slave},
    {"fmi2EnterEventMode", kExchange, false, &Walk::event_mode, Of::exchange},
    {"fmi2NewDiscreteStates", in(event), true, &Walk::new_states, Of::exchange},
    {"fmi2EnterContinuousTimeMode", in(event), false, &Walk::continuous_mode, Of::exchange},
    {"fmi2CompletedIntegratorStep", in(continuous), true, &Walk::completed, Of::exchange},
    {"fmi2SetTime", kExchange, true, &Walk::set_time, Of::exchange},
    {"fmi2SetContinuousStates", in(continuous), true, &Walk::set_states, Of::exchange},
    {"fmi2GetDerivatives", kRates, true, &Walk::get_derivatives, Of::exchange},
    {"fmi2GetEventIndicators", kRates, true, &Walk::get_indicators, Of::exchange},
    {"fmi2GetContinuousStates", kRates, true, &Walk::get_states, Of::exchange},
    {"fmi2GetNominalsOfContinuousStates", in(instantiated) | kRates, true, &Walk::get_nominals, Of::exchange},
};

}  // namespace

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
