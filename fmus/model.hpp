// What a physical model offers so that the runtime in this folder can make an FMU of it.
//
// A model keeps two kinds of memory, both plain and copyable, and nothing else that changes after build():
//   data()    the struct that the rows of its variable table point into: parameters, inputs, outputs;
//   memory()  everything an integrator remembers between two steps, as doubles.
// Saving and restoring a state is then two copies, for any model, and a restored model steps bitwise the same.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

namespace fmu {

/// A continuous input during one communication step: value and first three time derivatives at the step's start,
/// u(t + s) = u[0] + u[1] s + u[2] s^2/2 + u[3] s^3/6. After a step the runtime holds the end value.
using Polynomial = std::array<double, 4>;

/// Cannot go on: the text says what happened, where (value, allowed range, t, iteration), and the remedy.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// How far a step came. `reached` < t + h asks the host for a smaller step; `reason` says why, empty on success.
struct StepResult {
  double reached = 0.0;
  std::string reason;
};

class Model {
 public:
  virtual ~Model() = default;

  virtual std::span<std::byte> data() = 0;
  virtual std::span<double> memory() = 0;

  /// Builds all that follows from the parameters alone; checks them across rows. Called again after a parameter of
  /// initialisation changed. Throws Error and leaves the model as it was.
  virtual void build() = 0;

  /// Sets memory() to the start at time t [s] for the present parameters and inputs. Throws Error.
  virtual void initialise(double t) = 0;

  /// Advances memory() from t to t + h [s] under the polynomial inputs in data(); on a partial step memory() belongs to
  /// `reached`. Throws Error when no smaller step can help; the runtime then puts memory() back.
  virtual StepResult step(double t, double h) = 0;

  /// Writes all outputs, and their first time derivatives where the table has them, for memory() and the inputs'
  /// values at time t [s].
  virtual void evaluate(double t) = 0;

  // Continuous states, for model exchange and directional derivatives: those that the table declares, in its order,
  // whatever the parameters. They are a view of memory(); what the present parameters do not need stays 0.

  /// Why the model as built has no such states; empty where it has.
  virtual std::string without_states() const { return "this model has no continuous states"; }

  virtual void get_states(std::span<double> /*x*/) {}
  virtual void set_states(std::span<const double> /*x*/) {}

  /// Writes the states' time derivatives for memory() and the inputs' values at time t [s]. Returns why there are none
  /// here, empty on success. Leaves memory() alone.
  virtual std::string rates(double /*t*/, std::span<double> /*dx*/) { return without_states(); }

  /// The exact derivative of rates() in the direction dx of the states and du of the inputs, du being what their first
  /// time derivatives in data() are set to. False: not offered here, differences will do.
  virtual bool rates_along(double /*t*/, std::span<const double> /*dx*/, std::span<double> /*ddx*/) { return false; }

  /// Where memory() follows the inputs at once, as an equilibrium does: its rate under the inputs' first time
  /// derivatives in data(). False: memory() has a past of its own, which no derivative at an instant moves.
  virtual bool drift(std::span<double> /*rate*/) { return false; }

  /// Takes note that a host's integrator has accepted the present states.
  virtual void complete_step() {}

  /// Set by the runtime: passes a warning to the host's log.
  std::function<void(std::string_view)> warn = [](std::string_view) {};
};

}  // namespace fmu
