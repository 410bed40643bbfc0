// The rod as a model for the FMU runtime.
#pragma once

#include <memory>
#include <vector>

#include "data.hpp"
#include "engine.hpp"
#include "model.hpp"

namespace rod {

class RodModel final : public fmu::Model {
 public:
  std::span<std::byte> data() override { return std::as_writable_bytes(std::span(&data_, 1)); }
  std::span<double> memory() override { return memory_; }
  void build() override;
  void initialise(double t) override;
  fmu::StepResult step(double t, double h) override;
  void evaluate(double t) override;

 private:
  Data data_;
  std::vector<double> memory_;
  std::unique_ptr<Engine> engine_;
};

}  // namespace rod
