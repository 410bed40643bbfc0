// Notices inputs that a host of model exchange changes in jumps.
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

namespace fmu {

/// Some hosts hold the inputs over each step of a multistep integrator and change them at its end, without an event
/// (FMPy's CVode does so with ramps). The derivatives then jump behind the back of the integrator, whose error test
/// fails for any step length when the model is stiff. Inputs that were the same at all evaluations of a step and
/// differ at its end have jumped. Of inputs that the host moves along with time they differ between evaluations.
class InputWatch {
 public:
  /// The derivatives are evaluated at time t [s] with these inputs.
  void evaluate(double t, std::span<const double> inputs) {
    if (time_ && *time_ != t) have_two_times_ = true;
    if (time_ && !is_same(inputs)) are_held_ = false;
    time_ = t;
    inputs_.assign(inputs.begin(), inputs.end());
  }
  /// A step has ended with these inputs. Returns whether they have jumped.
  bool complete_step(std::span<const double> inputs) {
    const bool jumped = have_two_times_ && are_held_ && !is_same(inputs);
    are_held_ = true;
    return jumped;
  }
  /// The integration starts anew.
  void restart() { time_.reset(), have_two_times_ = false, are_held_ = true; }

 private:
  bool is_same(std::span<const double> inputs) const {
    return std::equal(inputs.begin(), inputs.end(), inputs_.begin());
  }

  std::optional<double> time_;  // of the last evaluation [s]
  std::vector<double> inputs_;  // of the last evaluation
  bool have_two_times_ = false, are_held_ = true;
};

}  // namespace fmu
