// What a physical model offers so that the runtime in this folder can make an FMU of it.
//
// A model keeps two kinds of memory, both plain and copyable, and nothing else that changes after build():
//   data()    the struct that the rows of its variable table point into: parameters, inputs, outputs;
//   memory()  everything an integrator remembers between two steps, as doubles.
// Saving and restoring a state is then two copies, for any model, and a restored model steps bitwise the same.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/status.hpp"
#include "core/time_polynomial.hpp"

namespace fmu {

using core::Status;

/// A continuous input during one communication step. After a step the runtime holds the end value.
using Polynomial = core::Cubic;

/// A call that the runtime refuses or that failed, on its way to functions.cpp, where all are caught: what, where,
/// allowed range, remedy. Models report failures as Status instead.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message, core::Severity severity = core::Severity::error)
      : std::runtime_error(message), severity_(severity) {}
  explicit Error(const Status& status) : Error(status.text(), status.failure().severity) {}

  core::Severity severity() const { return severity_; }

 private:
  core::Severity severity_;
};

/// Throws Error on a failure.
inline void require(const Status& status) {
  if (!status.is_ok()) throw Error(status);
}

/// Outcome of Model::step.
struct StepResult {
  double reached = 0.0;  // time [s] that memory() belongs to
  Status status;         // success when reached = t + h
};

class Model {
 public:
  virtual ~Model() = default;

  virtual std::span<std::byte> data() = 0;
  virtual std::span<double> memory() = 0;

  /// Builds all that follows from the parameters alone; checks them across rows. Called again after a parameter of
  /// initialisation changed. On failure the model stays as it was.
  virtual Status build() = 0;

  /// Brings what build() made up to date after tunable parameters changed in an instance that runs; memory() keeps its
  /// size and means the same state. On failure the model stays as it was.
  virtual Status retune(double /*t*/) { return {}; }

  /// Sets memory() to the start at time t [s] for the present parameters and inputs.
  virtual Status initialise(double t) = 0;

  /// Advances memory() from t to t + h [s] under the polynomial inputs in data(). A discard leaves memory() at
  /// `reached`; on an error the runtime restores memory().
  virtual StepResult step(double t, double h) = 0;

  /// Writes the outputs that the table does not declare on demand, and their first time derivatives where it has them,
  /// for memory() and the inputs' values at time t [s]. An output that a built model never writes stays
  /// core::kUnwritten, which no host can read.
  virtual Status evaluate(double t) = 0;

  /// Writes the outputs of these parts (Variable::part), after evaluate() for the same memory and inputs.
  virtual Status evaluate_on_demand(double /*t*/, unsigned /*parts*/) { return {}; }

  // Continuous states, for model exchange and directional derivatives: those that the table declares, in its order,
  // whatever the parameters. They are a view of memory(); what the present parameters do not need stays 0.

  /// Success when the model as built has continuous states; otherwise an error with the reason.
  virtual Status check_states() const { return Status::error("this model has no continuous states"); }

  virtual void get_states(std::span<double> /*x*/) {}
  virtual void set_states(std::span<const double> /*x*/) {}

  /// Writes the states' time derivatives for memory() and the inputs' values at time t [s]. Leaves memory() alone.
  virtual Status rates(double /*t*/, std::span<double> /*dx*/) { return check_states(); }

  /// Writes the exact derivative of rates() in the direction dx of the states and du of the inputs; du is taken from
  /// the inputs' first time derivatives in data(). False: not offered, the runtime uses finite differences.
  virtual bool rates_along(double /*t*/, std::span<const double> /*dx*/, std::span<double> /*ddx*/) { return false; }

  /// Writes the time derivative of memory() under the inputs' first time derivatives in data(), for a model whose
  /// memory is an equilibrium of its inputs. False: memory() has dynamic states and does not react instantaneously.
  virtual bool drift(std::span<double> /*rate*/) { return false; }

  /// Called when a host's integrator has accepted the present states.
  virtual Status complete_step() { return {}; }

  /// Refuses numbers that memory() never holds; asked before a state of unknown origin is restored.
  virtual Status check_memory(std::span<const double> memory) const {
    for (const double number : memory)
      if (!std::isfinite(number)) return Status::error("the state holds a number that is not finite");
    return {};
  }

  /// Logs `text()` unless warning number `bit` (0 to 31) was given before in this run.
  template <class Text>
  void warn_once(unsigned bit, Text&& text) {
    if (warnings_given >> bit & 1u) return;
    has_held_back = has_held_back || is_silent;
    if (is_silent) return;
    warnings_given |= 1u << bit;
    warn(text());
  }

  // Set by the runtime.
  std::function<void(std::string_view)> warn = [](std::string_view) {};  // passes a warning to the host's log
  std::uint32_t warnings_given = 0;  // one bit per warning; part of the saved state, 0 after a reset
  bool is_silent = false;            // while outputs are evaluated at points that are not on the trajectory
  bool has_held_back = false;        // a warning was held back while silent
  /// memory() and inputs are those of the last evaluation, or of the end of the last step: what was calculated then
  /// may be used again.
  bool is_same_point = false;
};

}  // namespace fmu
