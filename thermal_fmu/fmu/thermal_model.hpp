// Adapts the heat problem to fmu::Model.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "fmu/data.hpp"
#include "levels/heat_level.hpp"
#include "model/model.hpp"

namespace thermal {

using core::Status;

class ThermalModel final : public fmu::Model {
 public:
  explicit ThermalModel(std::size_t tcas = core::kDefaultTcas) : data_(tcas) {}

  std::span<std::byte> data() override { return std::as_writable_bytes(std::span(&data_, 1)); }
  std::span<double> memory() override { return memory_; }
  Status build() override;
  Status retune(double t) override;
  Status initialise(double t) override;
  fmu::StepResult step(double t, double h) override;
  Status evaluate(double t) override;
  Status evaluate_on_demand(double t, unsigned parts) override;
  Status check_states() const override;
  void get_states(std::span<double> x) override;
  void set_states(std::span<const double> x) override;
  Status rates(double t, std::span<double> dx) override;
  Status complete_step() override { return level_->note_powers(memory_, drive()); }

 private:
  Drive drive() const;
  void adopt(std::unique_ptr<HeatLevel> level);

  Data data_;
  Parameters built_;  // that the level was built for, if there is one
  std::unique_ptr<HeatLevel> level_;
  std::vector<double> memory_;
  std::string accuracy_;  // what a search that ended at its cap asked for and reached; empty: all was reached
};

}  // namespace thermal
