// One FMU instance: a model, what the host set and where it stands in time. Knows no FMI type; every failure is an
// Error.
#pragma once

#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "description/blueprint.hpp"
#include "runtime/allowed_calls.hpp"
#include "runtime/input_watch.hpp"
#include "runtime/logging.hpp"
#include "runtime/snapshot.hpp"

namespace fmu {

using Reference = unsigned int;

/// A family of get and set functions and the C type that it carries; enumerations go through the integer functions.
enum class Access { real, integer, boolean };

inline Access access_of(Type type) {
  if (type == Type::real) return Access::real;
  return type == Type::boolean ? Access::boolean : Access::integer;
}

template <Access access>
using ValueOf = std::conditional_t<access == Access::real, double, int>;

class Instance {
 public:
  Instance(std::shared_ptr<const Blueprint> blueprint, Interface interface, Log log);
  Instance(const Instance&) = delete;

  Log& log() { return log_; }
  const Progress& progress() const { return progress_; }
  void set_mode(Mode mode) {
    progress_.mode = mode;
    input_watch_.restart();
  }

  /// Throws Error when the standard does not allow the call now.
  void permit(const Call& call) const;

  void setup_experiment(std::optional<double> tolerance, double start, std::optional<double> stop);
  void exit_initialization();
  void reset();

  /// Reads values; brings outputs up to date first. `values` may be partly written when an Error is thrown.
  template <Access access>
  void get(std::span<const Reference> references, ValueOf<access>* values);

  /// Writes all values or, when one is refused, none.
  template <Access access>
  void set(std::span<const Reference> references, const ValueOf<access>* values);

  /// The derivative of unknowns (outputs, derivatives of states) in the direction `known` of inputs, states and tunable
  /// parameters; while the instance is initialised, of everything calculated and of inputs and parameters. `unknown` is
  /// what changes.
  /// Exact for rates where the model offers it, else central differences of order 4: differences.cpp.
  void directional_derivative(std::span<const Reference> unknowns, std::span<const Reference> knowns,
                              const double* known, double* unknown);

  /// Time derivatives of inputs, orders 1 to 3, for the next step only.
  void set_input_derivatives(std::span<const Reference> references, const int* orders, const double* values);

  /// Time derivatives of real outputs at the end of the last step; order 1, 0 for higher orders.
  void get_output_derivatives(std::span<const Reference> references, const int* orders, double* values);

  /// From t to t + h [s]. False after a part of the step: the state is that of progress().time and `log()` has the
  /// reason. Throws Error and keeps the state at t when the step cannot be made.
  bool step(double t, double h);

  // Model exchange. Spans have one number per state of the table; Error otherwise.
  void set_time(double t);
  void set_states(std::span<const double> x);
  void get_states(std::span<double> x);
  void get_nominals(std::span<double> x) const;
  /// Throws a discarding Error where the model has no derivatives: a host may try another point.
  void get_derivatives(std::span<double> dx);
  /// The present states are on the trajectory: what was held back of warnings is said now if it still holds. Returns
  /// whether the inputs have jumped, so that the host's integrator has to start anew.
  bool complete_step();

  void save(Snapshot& snapshot);
  void restore(const Snapshot& snapshot);

  /// States given to the host, who names them by address. add() takes ownership; find() and remove() throw Error on an
  /// address that this instance did not give out or that was freed.
  Snapshot* add(std::unique_ptr<Snapshot> snapshot);
  Snapshot& find(const void* state) const;
  void remove(const void* state);
  Snapshot deserialise(std::span<const std::byte> bytes);

  const Blueprint& blueprint() const { return blueprint_; }

  /// A warning was logged since this was last asked.
  bool take_warning() { return std::exchange(warned_, false); }

 private:
  bool is_starting() const { return progress_.mode == Mode::instantiated || progress_.mode == Mode::initialization; }
  std::byte* data() { return model_->data().data(); }
  const Variable& row(Reference reference, Access access) const {
    if (reference >= blueprint_.rows.size() || access_of(blueprint_.rows[reference].type) != access)
      refuse(reference, access);
    return blueprint_.rows[reference];
  }
  [[noreturn]] void refuse(Reference reference, Access access) const;
  void check(const Variable& row, double value) const;
  void mark_changed();
  void retune(std::span<const double> before);
  void read_parameters(std::vector<double>& values);
  void write_parameters(std::span<const double> values);
  void build_and_initialise();
  void invalidate();
  void refresh(Causality causality);
  void refresh_on_demand(unsigned parts);
  void move(const Variable& known, double change);
  bool is_known(const Variable& variable) const;
  void aim(std::span<const Reference> knowns, const double* known);
  std::vector<double> rates_along(std::span<const Reference> knowns, const double* known);
  void refresh_rates();
  std::span<const double> present_inputs();
  std::string now() const;
  /// Requires a status, and says when it failed; the time is written only then, for it is allocated.
  void require_now(Status status);
  void need_states(std::size_t count) const;
  void build();
  Status check_states() const;
  void use_tolerance(double asked);
  void check_step(double t, double h) const;
  bool are_inputs_constant() const;
  Status check_inputs(double h) const;
  bool discard_step(double t, double h, const Status& status);
  void set_input(Reference reference, double value);
  void output_rates(std::span<const Reference> references, double* rates);
  void step_rates(std::span<const Reference> references, double* rates);
  /// `value`; throws a discarding Error where it is not finite, so that no such number leaves with fmi2OK.
  double finite(const Variable& row, double value) const {
    if (!std::isfinite(value)) refuse(row, value);
    return value;
  }
  [[noreturn]] void refuse(const Variable& row, double value) const;
  void advance_inputs(double h, bool is_complete);

  const std::shared_ptr<const Blueprint> owner_;
  const Blueprint& blueprint_;
  Log log_;
  std::unique_ptr<Model> model_;
  Progress progress_;
  bool warned_ = false;
  std::vector<double> built_with_;         // see Snapshot
  std::vector<std::byte> start_data_;      // of a new instance, for reset
  std::vector<double> memory_before_;      // scratch of step()
  std::vector<double> input_rates_;        // see Snapshot
  std::vector<bool> has_new_derivatives_;  // per row: input derivatives set since a step that came part of the way
  // Views of memory(), all states of the model, brought up to date on demand.
  std::vector<double> states_, rates_;
  std::string missing_state_;  // a state that moves as built, though the configuration has left it out; empty: none
  bool has_states_ = false, has_rates_ = false;
  InputWatch input_watch_;          // of a host that integrates; not part of the state
  std::vector<double> inputs_;      // scratch of present_inputs()
  std::vector<double> parameters_;  // scratch of build_and_initialise(), restore() and set()
  std::vector<std::unique_ptr<Snapshot>> saved_;
};

}  // namespace fmu
