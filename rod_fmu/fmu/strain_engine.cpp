// Engine of the strain polynomials and their integrators.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "fmu/engine.hpp"
#include "integration/bdf.hpp"
#include "integration/creep.hpp"

namespace rod {

namespace {

class StrainEngine final : public Engine {
 public:
  explicit StrainEngine(const Parameters& p)
      : owner_(make_rod(p)), rod_(*owner_), dynamic_(p.dynamic), method_(p.method) {
    scratch_.reserve(rod_.unknowns());
    if (method_ == Method::bdf) bdf_.emplace(rod_.unknowns());
    if (std::any_of(p.tca.begin(), p.tca.begin() + static_cast<std::ptrdiff_t>(p.tcas),
                    [](const Tca& tca) { return tca.creep_compliance > 0.0; }))
      creep_.emplace();
  }

  long evaluations() const override { return scratch_.evaluations(); }

  /// The creep of every TCA follows the state.
  std::size_t memory_size() const override { return State::size(rod_.unknowns()) + (creep_ ? rod_.tcas() : 0); }

  void set_unloaded(std::span<double> memory) override { std::fill(memory.begin(), memory.end(), 0.0); }

  core::Status solve_equilibrium(std::span<double> memory, const Loads& loads) override {
    ready_ = 0;
    State now = state(memory);
    restore_creep(memory);
    return rod::solve_equilibrium(rod_, loads, now, scratch_);
  }

  StepOutcome step(std::span<double> memory, const Inputs& u, double h, double tolerance) override {
    ready_ = 0;
    State now = state(memory);
    if (creep_) return creep_->step(*owner_, u, h, tolerance, now, creep_of(memory), scratch_);
    if (!dynamic_) return step_static(rod_, u, h, now, scratch_);
    switch (method_) {
      case Method::backward_euler:
        return step_backward_euler(rod_, u, h, now, scratch_);
      case Method::midpoint:
        return step_midpoint(rod_, u, h, now, scratch_);
      case Method::bdf:
        return bdf_->step(rod_, u, h, tolerance, now, scratch_);
      case Method::rosenbrock_3:
        return step_rosenbrock_3(rod_, u, h, tolerance, now, scratch_);
      case Method::rosenbrock:
      case Method::pade_euler:  // has its own engine
        break;
    }
    return step_rosenbrock(rod_, u, h, tolerance, now, scratch_);
  }

  core::Status check_motion(std::span<double> memory) const override {
    const State now = state(memory);
    core::Status status = rod_.check_strains(now.q.data());
    return status.is_ok() ? rod_.check_rates(now.v.data()) : std::move(status);
  }

  void outputs(std::span<double> memory, const Loads& loads, unsigned parts, bool is_same, Outputs& y) override {
    const State now = state(memory);
    restore_creep(memory);
    Workspace& work = scratch_.newton.work;
    const unsigned had = is_same ? ready_ : 0;
    const unsigned missing = rod_.stages_of(dynamic_ ? parts & ~part::spatial_error : parts) & ~had;
    rod_.kinematics(now.q.data(), now.v.data(), loads, work, missing);
    ready_ = had | missing;
    rod_.outputs(now.q.data(), now.v.data(), loads, work, y, parts);
    y.energy_dissipated = now.dissipated;
    if (parts & part::spatial_error)
      y.spatial_error = dynamic_ ? rod_.spatial_error(now.q.data()) : rod_.spatial_error(now.q.data(), loads, work);
  }

  core::Status clamp_reaction(std::span<double> memory, const Loads& loads, Outputs& y) override {
    ready_ = 0;
    copy_.assign(memory.begin(), memory.end());
    State now = state(copy_);
    restore_creep(copy_);
    Workspace& work = scratch_.newton.work;
    if (dynamic_) {
      if (core::Status status = solve_acceleration(rod_, loads, now, scratch_); !status.is_ok()) return status;
      rod_.residual(now.q.data(), now.v.data(), now.a.data(), loads, work, scratch_.r);
    } else {
      rod_.static_residual(now.q.data(), loads, work, scratch_.r);
    }
    rod_.clamp_reaction(loads, work, y);
    return {};
  }

  std::string doubt() const override {
    switch (scratch_.stability.doubt()) {
      case Stability::Doubt::ambiguous:
        return "the rod left an unstable equilibrium in an arbitrary direction; a small side load would choose it";
      case Stability::Doubt::unstable:
        return "the equilibrium is unstable under the moment at the tip; see dynamic = true for the motion from it";
      case Stability::Doubt::none:
        break;
    }
    return "";
  }

  bool equilibrium_rate(std::span<double> memory, const Loads& loads, const Loads& change,
                        std::span<double> rate) override {
    ready_ = 0;
    const State now = state(memory);
    restore_creep(memory);
    const Vector zero = Vector::Zero(rod_.unknowns());
    Workspace& work = scratch_.newton.work;
    rod_.residual(now.q.data(), zero.data(), zero.data(), loads, work, scratch_.r);
    Matrix K;
    rod_.tangent(work, {.q = 1.0}, K);
    Vector dr;
    rod_.load_derivative(work, loads, change, dr);
    std::ranges::fill(rate, 0.0);
    state(rate).q = -K.lu().solve(dr);
    return std::ranges::all_of(rate, [](double each) { return std::isfinite(each); });
  }

  void discard_look_ahead(std::span<double> memory) const override { state(memory).time_ahead = 0.0; }

  void get_states(std::span<double> memory, std::span<double> x) const override {
    const State now = state(memory);
    write_states(now.q, now.v, now.dissipated, x);
  }

  void set_states(std::span<double> memory, std::span<const double> x) const override {
    State now = state(memory);
    rod_.from_states(x.data(), now.q.data());
    const std::size_t half = (x.size() - 1) / 2;
    rod_.from_states(x.data() + half, now.v.data());
    now.dissipated = x[2 * half];
    now.time_ahead = 0.0;
  }

  core::Status rates(std::span<const double> memory, const Loads& loads, std::span<double> dx) override {
    ready_ = 0;
    copy_.assign(memory.begin(), memory.end());
    State now = state(copy_);
    core::Status status = check_motion(copy_);
    if (status.is_ok()) status = solve_acceleration(rod_, loads, now, scratch_);
    if (status.is_ok()) write_states(now.v, now.a, rod_.damping_power(now.v), dx);
    return status;
  }

  bool rates_along(std::span<const double> memory, const Loads& loads, const Loads& change, std::span<const double> dx,
                   std::span<double> ddx) override {
    ready_ = 0;
    copy_.assign(memory.begin(), memory.end());
    State now = state(copy_);
    if (!solve_acceleration(rod_, loads, now, scratch_).is_ok()) return false;
    // r(q, v, a, u) = 0 at all times: M da = -(r_q dq + r_v dv + r_u du).
    Workspace& work = scratch_.newton.work;
    rod_.residual(now.q.data(), now.v.data(), now.a.data(), loads, work, scratch_.r);
    std::vector<double> along(copy_.size());
    set_states(along, dx);
    State d = state(along);
    Matrix J;
    rod_.tangent(work, {.q = 1.0}, J);
    Vector dr, r = J * d.q;
    rod_.tangent(work, {.v = 1.0}, J);
    r += J * d.v;
    rod_.load_derivative(work, loads, change, dr);
    r += dr;
    rod_.tangent(work, {.a = 1.0}, J);
    d.a = -J.lu().solve(r);
    rod_.damping_force(now.v, r);
    write_states(d.v, d.a, 2.0 * r.dot(d.v), ddx);
    return d.a.allFinite();
  }

 private:
  State state(std::span<double> memory) const { return State(memory.data(), rod_.unknowns()); }
  double* creep_of(std::span<double> memory) const { return memory.data() + State::size(rod_.unknowns()); }
  void restore_creep(std::span<double> memory) {
    if (creep_) set_creep(*owner_, creep_of(memory));
  }

  void write_states(const Eigen::Map<Vector>& first, const Eigen::Map<Vector>& second, double last,
                    std::span<double> x) const {
    const std::size_t half = (x.size() - 1) / 2;
    rod_.to_states(first.data(), x.data());
    rod_.to_states(second.data(), x.data() + half);
    x[2 * half] = last;
  }

  std::unique_ptr<Rod> owner_;
  const Rod& rod_;
  bool dynamic_;
  Method method_;
  Scratch scratch_;
  unsigned ready_ = 0;        // stages of the last call of outputs() that are still in scratch_.newton.work
  std::vector<double> copy_;  // scratch of rates()
  std::optional<Bdf> bdf_;
  std::optional<CreepIntegrator> creep_;
};

}  // namespace

std::unique_ptr<Engine> make_strain_engine(const Parameters& p) { return std::make_unique<StrainEngine>(p); }

}  // namespace rod
