// A subsystem of a block: an instance of an FMU that the Python master made, and the newest samples of its outputs.
#pragma once

#include <fmi2FunctionTypes.h>

#include <array>
#include <vector>

#include "engine/blas.hpp"

namespace engine {

constexpr int rows = 4;  // of a polynomial: c0 to c3

/// The polynomial (4, outputs) through the two samples, as fit_cubic() in cosim/extrapolation.py; each is its time,
/// values and rates.
void fit_cubic(const Blas& blas, std::size_t outputs, const double* from, const double* to, double* polynomial);

class Subsystem {
 public:
  Subsystem(TcaNode& node, const TcaBlas& blas);

  /// Each is true where the FMU answered fmi2OK and all numbers are finite.
  bool save();
  bool restore();
  bool step(double time, double length, double end);  ///< Sends the inputs, advances, and reads the outputs.
  bool record(double* row);

  /// Sets inputs from groups of links. `newest`: the sample at the end of the step, null: each source's own.
  bool receive(const TcaGroup* groups, std::size_t size, std::vector<Subsystem>& all, double time,
               const double* const* newest = nullptr);

  const double* past(int k) const { return node_->samples + k * (1 + 2 * node_->outputs); }  ///< 2: the newest.
  const double* current() const { return current_.data(); }
  void accept();  ///< Makes the current sample the newest of the past.

  TcaNode& node() { return *node_; }
  bool go_back();  ///< To the start of the step, as if it had not been tried.

 private:
  bool send_inputs();
  bool sample(double time);
  void fit(const TcaGroup& group, const double* from, const double* to, double time);

  TcaNode* node_;
  Blas blas_;
  fmi2Component component_;
  std::vector<double> current_, polynomial_;
  std::vector<fmi2ValueReference> derivative_references_;
  std::vector<fmi2Integer> derivative_orders_, ones_;
  std::size_t restores_before_ = 0;
};

}  // namespace engine
