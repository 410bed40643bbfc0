// Model and variable table of the probe: x_i'' = (stiffness (x_{i-1} - 2 x_i + x_{i+1}) - damping x_i' + [i last]
// force) / mass, ten Runge-Kutta steps per communication step.
#include <cstring>
#include <vector>

#include "data.hpp"
#include "model/table.hpp"

namespace probe {
namespace {

constexpr int kSubsteps = 10;
constexpr double kBedlam = 5e4;  // [N]

class Chain : public fmu::Model {
 public:
  std::span<std::byte> data() override { return std::as_writable_bytes(std::span(&data_, 1)); }
  std::span<double> memory() override { return memory_; }

  fmu::Status build() override {
    if (data_.damping > 10.0 * data_.mass) return fmu::Status::error("damping is above 10 times the mass", "lower it");
    memory_.assign(2 * data_.masses, 0.0);
    ++builds_;
    return {};
  }

  fmu::Status initialise(double) override {
    std::fill(memory_.begin(), memory_.end(), 0.0);
    if (data_.is_clamped) return {};
    for (int i = 0; i < data_.masses; ++i) memory_[i] = data_.bias[0];
    return {};
  }

  fmu::StepResult step(double t, double h) override {
    const double done = std::min(h, data_.longest_step);
    for (int k = 0; k < kSubsteps; ++k) {
      const double s = done * k / kSubsteps, ds = done / kSubsteps;
      const auto k1 = rate(memory_, s);
      const auto k2 = rate(moved(k1, ds / 2), s + ds / 2);
      if (data_.scheme == Scheme::midpoint) {
        memory_ = moved(k2, ds);
        continue;
      }
      const auto k3 = rate(moved(k2, ds / 2), s + ds / 2);
      const auto k4 = rate(moved(k3, ds), s + ds);
      for (std::size_t i = 0; i < memory_.size(); ++i) memory_[i] += ds / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
    }
    if (data_.force[0] < -1.0) warn("the force pulls by 100 % and #more");
    if (done < h) return {t + done, fmu::Status::discard("longer than longest_step", "ask for a smaller step")};
    return {t + h, {}};
  }

  fmu::Status evaluate(double) override {
    data_.x = memory_[data_.masses - 1];
    data_.v = memory_[2 * data_.masses - 1];
    if (!forgets_reading) data_.reading = data_.x + data_.bias[0];
    data_.builds = builds_;
    return {};
  }

  fmu::Status check_states() const override {
    if (data_.scheme == Scheme::classical) return {};
    return fmu::Status::error("scheme = midpoint is one of steps only", "choose classical");
  }
  void get_states(std::span<double> x) override {
    for (std::size_t i = 0; i < memory_.size(); ++i) x[state_index(i)] = memory_[i];
  }
  void set_states(std::span<const double> x) override {
    for (std::size_t i = 0; i < memory_.size(); ++i) memory_[i] = x[state_index(i)];
  }
  fmu::Status rates(double, std::span<double> dx) override {
    if (data_.force[0] > data_.breaking_force) return fmu::Status::discard("the chain is broken");
    const State dy = rate(memory_, 0.0);
    for (std::size_t i = 0; i < dy.size(); ++i) dx[state_index(i)] = dy[i];
    return {};
  }

 private:
  using State = std::vector<double>;

  /// Where the i-th number of the memory stands among the states: positions, then velocities.
  std::size_t state_index(std::size_t i) const {
    const std::size_t n = data_.masses;
    return i < n ? i : kMostMasses + i - n;
  }

  State moved(const State& rate, double ds) const {
    State result = memory_;
    for (std::size_t i = 0; i < result.size(); ++i) result[i] += ds * rate[i];
    return result;
  }

  State rate(const State& y, double s) const {
    const int n = data_.masses;
    State dy(y.size());
    const double force = core::value(data_.force, s);
    if (force > kBedlam) throw 42;  // what nobody should throw
    if (force > data_.breaking_force) throw fmu::Error("force " + std::to_string(force) + " N breaks the chain");
    for (int i = 0; i < n; ++i) {
      const double left = i > 0 ? y[i - 1] : 0.0, right = i + 1 < n ? y[i + 1] : y[i];
      dy[i] = y[n + i];
      dy[n + i] = (data_.stiffness * (left - 2 * y[i] + right) - data_.damping * y[n + i]) / data_.mass;
    }
    dy[2 * n - 1] += force / data_.mass;
    return dy;
  }

  Data data_;
  State memory_;
  int builds_ = 0;
};

}  // namespace
}  // namespace probe

namespace fmu {

Identity identity() { return {"probe", "Chain of masses & springs, to try the \"runtime\" with", 1.0, 0.1}; }

std::vector<Variable> variables(const Configuration&) {
  const probe::Data d;
  Table<probe::Data> table(d);
  table.parameter("mass", d.mass, "kg", "Mass of each body, 0.1 < m").range(0.1, 10.0);
  table.parameter("stiffness", d.stiffness, "N/m", "Stiffness of each spring").range(0.0, 1e6).nominal(10.0);
  table.parameter("damping", d.damping, "N.s/m", "Damping of each body").range(0.0, 1e3);
  table.parameter("masses", d.masses, "", "Number of bodies").range(1, probe::kMostMasses);
  table.parameter("is_clamped", d.is_clamped, "", "Starts at zero whatever the bias");
  table.parameter("scheme", d.scheme, "", "Integrator").choices({"midpoint", "classical"});
  table.parameter("tolerance", d.tolerance, "1", "Relative tolerance").range(1e-12, 1e-2).tunable();
  table.parameter("longest_step", d.longest_step, "s", "Steps come no further than this").range(0.0, 1e3).tunable();
  table.parameter("breaking_force", d.breaking_force, "N", "A larger force is an error").range(0.0, 1e6).tunable();
  table.input("force", d.force, "N", "Force on the last body").range(-1e5, 1e5);
  table.input("bias", d.bias, "m", "Added to the reading at once, and the start position");
  table.output("x", d.x, d.v, "m", "Displacement of the last body").depends({"position"});
  table.output("v", d.v, "m/s", "Velocity of the last body").depends({"velocity"});
  table.output("reading", d.reading, "m", "x + bias").depends({"bias", "position"});
  table.output("builds", d.builds, "", "How often build() ran");
  for (std::size_t i = 0; i < probe::kMostMasses; ++i)
    table.state(indexed("position", i), "m", "m/s", "Displacement of a body")
        .starts_from({"bias"})
        .depends({indexed("velocity", i)});
  for (std::size_t i = 0; i < probe::kMostMasses; ++i)
    table.state(indexed("velocity", i), "m/s", "m/s2", "Velocity of a body")
        .starts_from({})
        .depends({"position", "velocity", "force"});
  return std::move(table).rows();
}

std::unique_ptr<Model> make_model(const Configuration&) { return std::make_unique<probe::Chain>(); }

}  // namespace fmu
