#include "fmu/thermal_model.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "levels/full_level.hpp"
#include "levels/modal_level.hpp"
#include "mesh/heat_matrices.hpp"
#include "mesh/resolution.hpp"
#include "reduction/modal_model.hpp"

namespace thermal {
namespace {

constexpr double kHottest = 373.15;           // where the paper's assumptions end [K]
constexpr double kReferenceTolerance = 1e-4;  // of the model that `lumped` is compared with

std::unique_ptr<HeatLevel> make_level(const HeatMatrices& matrices, const Parameters& p) {
  switch (p.level) {
    case Level::full:
      return std::make_unique<FullLevel>(matrices, p);
    case Level::reduced:
      return std::make_unique<ModalLevel>(reduced(matrices, p.tolerance), p);
    default:
      return std::make_unique<ModalLevel>(lumped(matrices, reduced(matrices, kReferenceTolerance)), p);
  }
}

}  // namespace

Status ThermalModel::build() {
  core::Result<HeatMatrices> matrices = resolved_matrices(data_.parameters);
  if (!matrices.status.is_ok()) return std::move(matrices.status);
  level_ = make_level(matrices.value, data_.parameters);
  memory_.assign(level_->state_size(), 0.0);
  return {};
}

Status ThermalModel::initialise(double) {
  std::fill(memory_.begin(), memory_.end(), 0.0);
  has_warned_ = false;
  return {};
}

Drive ThermalModel::drive() const {
  Drive drive{data_.V, data_.delta, data_.T_ambient};
  drive.ambient_rise[0] -= data_.parameters.T_0;
  return drive;
}

fmu::StepResult ThermalModel::step(double t, double h) {
  Status status = level_->advance(memory_, drive(), h, data_.parameters.tolerance);
  if (status.is_ok() && !std::all_of(memory_.begin(), memory_.end(), [](double v) { return std::isfinite(v); }))
    status = Status::error("temperatures are not finite", "reduce the voltages or their derivatives");
  if (status.is_ok()) return {t + h, {}};
  std::ostringstream where;
  where << "heat, step from t = " << t << " s of " << h << " s";
  return {t, std::move(status).at(where.str()).as_error()};
}

Status ThermalModel::check_states() const {
  if (data_.parameters.level == Level::full)
    return Status::error("level = full has as many states as its mesh has nodes", "choose reduced or lumped");
  if (level_->amplitudes() > kMostAmplitudes)
    return Status::error("level = reduced has " + std::to_string(level_->amplitudes()) + " states, allowed: up to " +
                             std::to_string(kMostAmplitudes),
                         "choose a larger tolerance");
  return {};
}

void ThermalModel::get_states(std::span<double> x) {
  if (check_states().is_ok()) level_->get_amplitudes(memory_, x);
}

void ThermalModel::set_states(std::span<const double> x) { level_->set_amplitudes(memory_, x); }

Status ThermalModel::rates(double, std::span<double> dx) { return level_->rates(memory_, drive(), dx); }

Status ThermalModel::evaluate(double t) {
  const double T_0 = data_.parameters.T_0;
  Observation seen;
  if (Status status = level_->observe(memory_, drive(), seen); !status.is_ok())
    return std::move(status).at("heat, t = " + std::to_string(t) + " s").as_error();
  for (std::size_t i = 0; i < kTcas; ++i) data_.T[i] = T_0 + seen.rise[i];
  data_.T_rate = seen.rate;
  data_.P = seen.power;
  data_.Q_loss = seen.loss;
  data_.E_stored = seen.stored;
  data_.T_max = T_0 + seen.max_rise;
  data_.T_surface = T_0 + seen.surface_rise;
  data_.reduction_bound = seen.bound;
  data_.reduction_states = level_->unknowns();
  if (data_.T_max > kHottest && !has_warned_) {
    has_warned_ = true;
    std::ostringstream text;
    text << "t = " << t << " s: the hottest point of the section is at " << data_.T_max - 273.15
         << " degC, above 100 degC the model's assumptions end; reduce the voltages";
    warn(text.str());
  }
  return {};
}

}  // namespace thermal
