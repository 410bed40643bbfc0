// Random calls of one instance, legal and illegal, with good and bad arguments.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "library.hpp"

namespace host {

enum Mode { instantiated, initialization, running, failed, event, continuous, terminated, broken };
constexpr unsigned in(Mode mode) { return 1u << mode; }
constexpr unsigned kSlave = in(running) | in(failed), kExchange = in(event) | in(continuous);
constexpr unsigned kEnd = in(terminated) | in(broken), kStart = in(instantiated) | in(initialization);
constexpr unsigned kLive = kStart | kSlave | kExchange | kEnd;
constexpr unsigned kRead = kLive & ~in(instantiated), kSet = kStart | kSlave | kExchange;
constexpr unsigned kRates = in(initialization) | kExchange | kEnd;

enum class Interface { both, slave, exchange };  // those that have a function

struct Counts {
  long calls = 0, illegal = 0, bad = 0, discards = 0, errors = 0, blobs = 0, accepted = 0, repeats = 0;
};

/// One instance under random calls.
class Walk {
 public:
  Walk(const Library& fmu, const Description& description, std::uint64_t seed);
  ~Walk() { fmu_.FreeInstance(instance_); }

  void run(long calls);

  Counts counts;

 private:
  struct Action {
    const char* name;
    unsigned modes;
    bool has_arguments;
    fmi2Status (Walk::*call)();
    Interface interface = Interface::both;
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

  void create();

  std::vector<char> bytes();

  double plausible(const Variable& v) {
    const double size = std::max(1.0, std::abs(v.start)), value = v.start + 0.1 * size * uniform(-1.0, 1.0);
    return std::min(std::max(value, v.least), v.most);
  }

  // Calls; those of a bad kind must be refused.
  // Life cycle
  fmi2Status debug();
  fmi2Status setup();
  fmi2Status enter();
  fmi2Status leave();
  fmi2Status terminate();
  fmi2Status reset();
  fmi2Status moved(fmi2Status status, Mode from, Mode to);
  fmi2Status inquire();
  /// Frees and instantiates, seldom.
  fmi2Status recreate();

  // Values
  fmi2Status get_real();
  template <class Function>
  fmi2Status get_other(Function function, const char* type);
  fmi2Status get_integer();
  fmi2Status get_boolean();
  fmi2Status get_string();
  fmi2Status set_string();
  fmi2Status set_integer();
  fmi2Status set_boolean();
  fmi2Status set_real();
  fmi2Status set_derivatives();
  fmi2Status output_derivatives();
  fmi2Status directional();

  // States
  fmi2Status save();
  fmi2Status with_state(fmi2Status status, fmi2FMUstate state);
  fmi2Status free_state();
  /// Saves, steps, restores, steps again: the same bits.
  fmi2Status restore();
  fmi2Status size_of_state();
  fmi2Status serialise();
  /// Bytes with a flipped bit, cut short, or with numbers changed and the checksum made to fit.
  fmi2Status deserialise();
  /// Whatever a forged state holds, values are finite or refused.
  void behave();

  // Co-simulation
  fmi2Status step();
  fmi2Status cancel();
  int kind();
  fmi2Status answered(fmi2Status status);
  /// Kinds outside of the enumeration too.
  fmi2StatusKind any_kind();
  fmi2Status get_status();
  fmi2Status get_real_status();
  fmi2Status get_integer_status();
  fmi2Status get_boolean_status();
  fmi2Status get_string_status();

  // Model exchange
  fmi2Status event_mode();
  fmi2Status new_states();
  fmi2Status continuous_mode();
  fmi2Status completed();
  fmi2Status set_time();
  std::size_t room();
  fmi2Status set_states();
  fmi2Status finite_numbers(fmi2Status (*function)(fmi2Component, fmi2Real*, size_t));
  fmi2Status get_derivatives();
  fmi2Status get_states();
  fmi2Status get_nominals();
  fmi2Status get_indicators();

  const Library& fmu_;
  const Description& description_;
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

}  // namespace host
