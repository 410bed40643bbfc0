// Engine of the paper's scheme on grid points (Eqs. 21-25).
#include "fmu/engine.hpp"
#include "pade/grid_rod.hpp"

namespace rod {

namespace {

class GridEngine final : public Engine {
 public:
  explicit GridEngine(const Parameters& p) : rod_(p, Section::of(p), p.grid_points), scratch_(rod_.scratch()) {}

  long evaluations() const override { return scratch_.evaluations; }

  std::size_t memory_size() const override { return GridState::size(rod_.points(), rod_.tcas()); }

  void set_unloaded(std::span<double> memory) override {
    GridState now = state(memory);
    rod_.set_unloaded(now);
  }

  core::Status solve_equilibrium(std::span<double> memory, const Loads& loads) override {
    GridState now = state(memory);
    return rod_.solve_equilibrium(loads, now, scratch_);
  }

  StepOutcome step(std::span<double> memory, const Inputs& u, double h,
                   double) override {  // its step is the step asked for
    GridState now = state(memory);
    return rod_.step(u, h, now, scratch_);
  }

  void outputs(std::span<double> memory, const Loads& loads, unsigned parts, bool, Outputs& y) override {
    GridState now = state(memory);
    rod_.outputs(loads, now, y, parts);
  }

  double least_resolved_step() const override { return rod_.crossing_time(); }

  core::Status clamp_reaction(std::span<double> memory, const Loads& loads, Outputs& y) override {
    GridState now = state(memory);
    rod_.clamp_reaction(loads, now, y);
    return {};
  }

 private:
  GridState state(std::span<double> memory) const { return GridState(memory.data(), rod_.points(), rod_.tcas()); }

  GridRod rod_;
  GridScratch scratch_;
};

}  // namespace

std::unique_ptr<Engine> make_grid_engine(const Parameters& p) { return std::make_unique<GridEngine>(p); }

}  // namespace rod
