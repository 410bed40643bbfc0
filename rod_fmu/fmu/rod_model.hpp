// Adapter of the rod to the FMI runtime.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "fmu/doubts.hpp"
#include "fmu/engine.hpp"
#include "model/model.hpp"
#include "physics/data.hpp"
#include "physics/loads.hpp"

namespace rod {

class RodModel final : public fmu::Model {
 public:
  RodModel(std::size_t tcas, std::size_t segments, bool has_ports) : data_(tcas, segments, has_ports) {}

  std::span<std::byte> data() override { return std::as_writable_bytes(std::span(&data_, 1)); }
  std::span<double> memory() override { return memory_; }
  fmu::Status build() override;
  fmu::Status retune(double t) override;
  fmu::Status initialise(double t) override;
  fmu::StepResult step(double t, double h) override;
  fmu::Status evaluate(double t) override;
  fmu::Status evaluate_on_demand(double t, unsigned parts) override;
  fmu::Status check_memory(std::span<const double> memory) const override;
  fmu::Status check_states() const override;
  void get_states(std::span<double> x) override;
  void set_states(std::span<const double> x) override;
  fmu::Status rates(double t, std::span<double> dx) override;
  bool drift(std::span<double> rate) override;
  bool rates_along(double t, std::span<const double> dx, std::span<double> ddx) override;

 private:
  /// Memory of the engine, without what the adapter adds.
  std::span<double> engine_memory() { return std::span(memory_).first(engine_->memory_size()); }
  /// Memory of the energy watch; empty where the rod has damping.
  std::span<double> watch_memory();
  void set_displacement_ranges();
  /// The memory is another.
  void forget_outputs();
  /// The memory or the loads are others.
  void start_point(const Loads& loads);
  /// Writes these parts of the outputs where they are missing.
  void write(unsigned parts);
  /// Warns of TCAs that are shorter or longer than their coils can be.
  void warn_of_displacements(double t, const PerTca<double>& delta);
  /// Warns of what is doubtful about an equilibrium.
  void warn_of_doubt(double t);
  /// Warns of what is doubtful about a complete step from t to t + h [s].
  void warn_of_step(double t, double h);
  template <class Call>
  auto counted(Call call);

  Data data_;
  Loads loads_;                 // of the outputs below
  unsigned written_ = 0;        // parts of data_.outputs that were written for one memory and loads_
  bool is_started_ = false;     // some of them
  std::vector<double> memory_;  // memory of the engine, of the energy watch, then the count of evaluations
  std::unique_ptr<Engine> engine_;
  PerTca<DisplacementRange> displacement_ranges_;
  bool has_displacement_range_ = false;
};

}  // namespace rod
