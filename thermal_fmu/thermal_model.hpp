// Adapts the heat problem to fmu::Model.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "data.hpp"
#include "heat_level.hpp"
#include "model.hpp"

namespace thermal {

class ThermalModel final : public fmu::Model {
 public:
  std::span<std::byte> data() override { return std::as_writable_bytes(std::span(&data_, 1)); }
  std::span<double> memory() override { return memory_; }
  void build() override;
  void initialise(double t) override;
  fmu::StepResult step(double t, double h) override;
  void evaluate(double t) override;

 private:
  Drive drive() const;

  Data data_;
  std::unique_ptr<HeatLevel> level_;
  std::vector<double> memory_;
  bool has_warned_ = false;
};

}  // namespace thermal
