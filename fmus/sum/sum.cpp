// Model and variable table of sum.fmu: y = offset + sum over k of gain[k] u[k], at once and without a state.
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "model/table.hpp"

namespace sum {
namespace {

constexpr std::size_t kTerms = 12;  // as many as a body has TCAs; longer sums are sums of sums

struct Data {
  std::array<double, kTerms> gain{};
  double offset = 0.0;
  std::array<fmu::Polynomial, kTerms> u{};
  double y = 0.0;
  double rate = 0.0;
};

class Sum : public fmu::Model {
 public:
  std::span<std::byte> data() override { return std::as_writable_bytes(std::span(&data_, 1)); }
  std::span<double> memory() override { return {}; }
  fmu::Status build() override { return {}; }
  fmu::Status initialise(double) override { return {}; }
  fmu::StepResult step(double t, double h) override { return {t + h, {}}; }
  fmu::Status check_states() const override { return {}; }  // all of its none

  fmu::Status evaluate(double) override {
    data_.y = data_.offset;
    data_.rate = 0.0;
    for (std::size_t k = 0; k < kTerms; ++k) {
      data_.y += data_.gain[k] * data_.u[k][0];
      data_.rate += data_.gain[k] * data_.u[k][1];
    }
    return {};
  }

 private:
  Data data_;
};

}  // namespace
}  // namespace sum

namespace fmu {

Identity identity() { return {"sum", "Weighted sum of up to 12 numbers", 1.0, 0.1}; }

std::vector<Variable> variables(const Configuration&) {
  const sum::Data d;
  Table<sum::Data> table(d);
  for (std::size_t k = 0; k < sum::kTerms; ++k)
    table.parameter(indexed("gain", k), d.gain[k], "1", "Factor of u[k]; 0 leaves it out").tunable();
  table.parameter("offset", d.offset, "1", "Added to the sum").tunable();
  for (std::size_t k = 0; k < sum::kTerms; ++k)
    table.input(indexed("u", k), d.u[k], "1", "Term " + std::to_string(k + 1));
  table.output("y", d.y, d.rate, "1", "offset + sum of gain[k] u[k]").depends({"u"});
  return std::move(table).rows();
}

std::unique_ptr<Model> make_model(const Configuration&) { return std::make_unique<sum::Sum>(); }

}  // namespace fmu
