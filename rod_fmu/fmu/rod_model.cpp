// The calls of the FMI runtime, passed on to the engine, and what the user is warned of.
#include "fmu/rod_model.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "fmu/checks.hpp"
#include "fmu/doubts.hpp"
#include "fmu/energy_watch.hpp"
#include "fmu/message.hpp"

namespace rod {

namespace {

// Bits of Model::warn_once.
constexpr unsigned kPlaneWarning = 0, kSpatialErrorWarning = 1, kDoubtWarning = 2, kEnergyWarning = 3, kGridWarning = 4,
                   kParameterWarning = 5, kDisplacementWarning = 6;
// Change of the energy of an undamped rod under constant loads over what its forms have exchanged, beyond which the
// host is warned [1]: a tolerance of 1e-4 stays below over hundreds of oscillations.
constexpr double kEnergyDrift = 0.05;
constexpr double kOutOfPlaneWarning = 1e-6;  // of Outputs::out_of_plane [1]: beyond, the host is warned
// Largest Outputs::spatial_error over the length [1] without a warning: of a rod at rest, and of a moving one, whose
// estimate is coarser, and whose waves after a sudden load no order resolves.
constexpr double kSpatialWarning = 1e-2, kSpatialWarningMoving = 5e-2;

std::unique_ptr<Engine> make_engine(const Parameters& p) {
  return p.dynamic && p.method == Method::pade_euler ? make_grid_engine(p) : make_strain_engine(p);
}

}  // namespace

fmu::Status RodModel::build() {
  const Parameters& p = data_.parameters;
  if (fmu::Status status = check(p); !status.is_ok()) return status;
  engine_ = make_engine(p);
  memory_.assign(engine_->memory_size() + (EnergyWatch::applies_to(p) ? EnergyWatch::memory_size() : 0) + 1, 0.0);
  engine_->set_unloaded(engine_memory());
  forget_outputs();
  set_displacement_ranges();
  return {};
}

void RodModel::set_displacement_ranges() {
  has_displacement_range_ = false;
  for (std::size_t i = 0; i < data_.parameters.tcas; ++i) {
    displacement_ranges_[i] = {data_.parameters, i};
    has_displacement_range_ = has_displacement_range_ || displacement_ranges_[i].is_bounded();
  }
}

std::span<double> RodModel::watch_memory() {
  return std::span(memory_).subspan(engine_->memory_size(), memory_.size() - engine_->memory_size() - 1);
}

/// Returns call() and adds its evaluations of the residual to the count in the memory.
template <class Call>
auto RodModel::counted(Call call) {
  const long before = engine_->evaluations();
  auto result = call();
  memory_.back() += static_cast<double>(engine_->evaluations() - before);
  return result;
}

/// The strains stay, so the state of motion does; a shape at rest becomes the equilibrium of the new rod.
fmu::Status RodModel::retune(double t) {
  const Parameters& p = data_.parameters;
  if (fmu::Status status = check(p); !status.is_ok()) return status;
  std::unique_ptr<Engine> before = std::exchange(engine_, make_engine(p));
  const PerTca<DisplacementRange> ranges_before = displacement_ranges_;
  const bool had_range = has_displacement_range_;
  set_displacement_ranges();
  engine_->discard_look_ahead(engine_memory());
  forget_outputs();
  if (!watch_memory().empty()) EnergyWatch::restart(watch_memory());
  if (p.dynamic) return {};
  fmu::Status status =
      counted([&] { return engine_->solve_equilibrium(engine_memory(), loads_at(data_.inputs, 0.0)); });
  if (status.is_ok()) {
    warn_of_doubt(t);
    return status;
  }
  engine_ = std::move(before);
  displacement_ranges_ = ranges_before;
  has_displacement_range_ = had_range;
  return refuse("t = ", t, " s, after a change of parameters: ", status.failure().what, "; change them less");
}

fmu::Status RodModel::initialise(double t) {
  if (std::string doubt = doubt_parameters(data_.parameters); !doubt.empty())
    warn_once(kParameterWarning, [&] { return std::move(doubt); });
  engine_->set_unloaded(engine_memory());
  if (!watch_memory().empty()) EnergyWatch::restart(watch_memory());
  memory_.back() = 0.0;
  if (!data_.parameters.start_at_equilibrium && data_.parameters.dynamic) return {};
  fmu::Status status =
      counted([&] { return engine_->solve_equilibrium(engine_memory(), loads_at(data_.inputs, 0.0)); });
  if (status.is_ok()) {
    warn_of_doubt(t);
    return status;
  }
  return refuse("t = ", t, " s, at the start: ", status.failure().what,
                "; reduce the loads, or start unloaded (start_at_equilibrium = false)");
}

fmu::StepResult RodModel::step(double t, double h) {
  forget_outputs();
  if (fmu::Status status = check_temperatures(data_.parameters, temperatures_at(data_.inputs, h)); !status.is_ok())
    return {t, std::move(status)};
  StepOutcome outcome =
      counted([&] { return engine_->step(engine_memory(), data_.inputs, h, data_.parameters.tolerance); });
  if (outcome.reached == h) {
    if (data_.parameters.dynamic)
      warn_of_step(t, h);
    else
      warn_of_doubt(t + h);
    return {t + h, {}};
  }
  return {t + outcome.reached, std::move(outcome.status)};
}

fmu::Status RodModel::check_memory(std::span<const double> memory) const {
  // Infinity is legitimate: the integrator marks loads that did not stand still with it (look_ahead.cpp).
  for (const double number : memory)
    if (std::isnan(number)) return refuse("the state holds a number that is not a number");
  return {};
}

fmu::Status RodModel::check_states() const {
  const Parameters& p = data_.parameters;
  if (!p.dynamic) return refuse("with dynamic = false the shape is an equilibrium, not a state; set dynamic = true");
  if (p.method == Method::pade_euler)
    return refuse(
        "method = pade_euler is a scheme of time steps; choose another method, all others mean the same equations");
  return {};
}

void RodModel::get_states(std::span<double> x) {
  // With dynamic = false they cannot be set, but can be read: the strains of the equilibrium reached.
  if (!data_.parameters.dynamic || check_states().is_ok()) engine_->get_states(engine_memory(), x);
}

void RodModel::set_states(std::span<const double> x) { engine_->set_states(engine_memory(), x); }

fmu::Status RodModel::rates(double, std::span<double> dx) {
  return engine_->rates(engine_memory(), loads_at(data_.inputs, 0.0), dx);
}

bool RodModel::rates_along(double, std::span<const double> dx, std::span<double> ddx) {
  return engine_->rates_along(engine_memory(), loads_at(data_.inputs, 0.0), load_rates_at(data_.inputs, 0.0), dx, ddx);
}

bool RodModel::drift(std::span<double> rate) {
  return !data_.parameters.dynamic &&
         engine_->equilibrium_rate(engine_memory(), loads_at(data_.inputs, 0.0), load_rates_at(data_.inputs, 0.0),
                                   rate.first(engine_->memory_size()));
}

fmu::Status RodModel::evaluate(double t) {
  const Loads loads = loads_at(data_.inputs, 0.0);
  if (fmu::Status status = check_temperatures(data_.parameters, loads.T); !status.is_ok()) return status;
  // Where the host integrates, states may be anything.
  if (is_silent)
    if (fmu::Status status = engine_->check_motion(engine_memory()); !status.is_ok()) return status;
  const Outputs& y = data_.outputs;
  const bool is_inside = data_.parameters.closure == Closure::inside;
  const bool needs_delta = has_displacement_range_ && is_inside;
  // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): the same numbers to the last bit
  if (!is_same_point || std::memcmp(&loads, &loads_, sizeof loads) != 0) start_point(loads);
  write(part::out_of_plane | part::spatial_error | (needs_delta ? part::tcas : 0));
  data_.outputs.evaluations = memory_.back();
  const auto is_finite = [](double each) { return std::isfinite(each); };
  if (!is_finite(y.out_of_plane) || !is_finite(y.spatial_error) ||
      (needs_delta && !std::all_of(y.delta.begin(), y.delta.begin() + data_.parameters.tcas, is_finite)))
    return fmu::Status::discard("the outputs are not finite",
                                "the states or the inputs are beyond what the rod or its TCAs can have");
  const double limit = data_.parameters.dynamic ? kSpatialWarningMoving : kSpatialWarning;
  if (y.out_of_plane > kOutOfPlaneWarning)
    warn_once(kPlaneWarning, [&] {
      return message("t = ", t,
                     " s: forces across the plane of this planar rod are left out; alone they would cause strains of ",
                     y.out_of_plane, " (output out_of_plane); set planar = false, or turn plane");
    });
  else if (y.spatial_error > limit * data_.parameters.length())
    warn_once(kSpatialErrorWarning, [&] {
      return message("t = ", t, " s: strain polynomials of order = ", data_.parameters.segment[0].order,
                     " leave an estimated error of ", y.spatial_error,
                     " m in shape and displacements (output spatial_error); raise order, up to ", kMaxOrder,
                     ", or reduce the loads or tca.helix");
    });
  if (has_displacement_range_) warn_of_displacements(t, is_inside ? y.delta : loads.delta_guess);
  return {};
}

void RodModel::warn_of_displacements(double t, const PerTca<double>& delta) {
  const Parameters& p = data_.parameters;
  for (std::size_t i = 0; i < p.tcas; ++i)
    if (!displacement_ranges_[i].contains(delta[i]))
      warn_once(kDisplacementWarning, [&] {
        return message("t = ", t, " s: ", doubt_displacement(p, i, displacement_ranges_[i], delta[i]));
      });
}

fmu::Status RodModel::evaluate_on_demand(double, unsigned parts) {
  if (!is_same_point) start_point(loads_at(data_.inputs, 0.0));
  write(parts & ~part::clamp);
  return parts & part::clamp ? engine_->clamp_reaction(engine_memory(), loads_, data_.outputs) : fmu::Status{};
}

void RodModel::forget_outputs() {
  written_ = 0;
  is_started_ = false;
}

void RodModel::start_point(const Loads& loads) {
  forget_outputs();
  loads_ = loads;
}

void RodModel::write(unsigned parts) {
  const unsigned missing = parts & ~written_;
  if (missing) engine_->outputs(engine_memory(), loads_, missing, std::exchange(is_started_, true), data_.outputs);
  written_ |= missing;
}

void RodModel::warn_of_doubt(double t) {
  const std::string doubt = engine_->doubt();
  if (doubt.empty()) return;
  warn_once(kDoubtWarning, [&] { return message("t = ", t, " s: ", doubt); });
}

void RodModel::warn_of_step(double t, double h) {
  if (const double least = engine_->least_resolved_step(); h < least)
    warn_once(kGridWarning, [&] {
      return message("t = ", t + h, " s: steps of ", h, " s are shorter than the ", least,
                     " s in which a wave crosses one grid interval of this rod: after a sudden load the tip moves "
                     "at once, by the strain of that interval; take longer steps, raise grid_points, add "
                     "body.retardation, or choose another method");
    });
  if (watch_memory().empty()) return;
  start_point(loads_at(data_.inputs, h));
  write(part::energy | part::tip_position);
  const double drift = EnergyWatch::drift(watch_memory(), data_.parameters, data_.inputs, loads_, data_.outputs);
  if (std::abs(drift) > kEnergyDrift)
    warn_once(kEnergyWarning, [&] {
      return message(
          "t = ", t + h, " s: the energy of this undamped rod has changed by ", drift,
          " of what its forms exchanged, though its loads are constant; tighten tolerance, raise order, take "
          "shorter steps, or add damping (body.retardation)");
    });
}

}  // namespace rod
