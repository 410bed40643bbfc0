// The rod as a model for the FMU runtime.
#pragma once

#include <optional>
#include <vector>

#include "bdf.hpp"
#include "data.hpp"
#include "integrator.hpp"
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
  State state() { return State(memory_.data(), rod_.unknowns()); }

  Data data_;
  std::vector<double> memory_;
  Rod rod_;
  Scratch scratch_;
  std::optional<Bdf> bdf_;
};

}  // namespace rod
