#include "thermal_model.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "full_level.hpp"
#include "heat_matrices.hpp"
#include "modal_level.hpp"
#include "modal_model.hpp"
#include "resolution.hpp"

namespace thermal {
namespace {

constexpr double kHottest = 373.15;           // where the paper's assumptions end [K]
constexpr double kReferenceTolerance = 1e-4;  // of the model that `lumped` is compared with

std::unique_ptr<HeatLevel> make_level(const Parameters& p) {
  const HeatMatrices matrices = resolved_matrices(p);
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

void ThermalModel::build() {
  std::unique_ptr<HeatLevel> level;
  try {
    level = make_level(data_.parameters);
  } catch (const std::invalid_argument& problem) {
    throw fmu::Error(problem.what());
  }
  level_ = std::move(level);
  memory_.assign(level_->state_size(), 0.0);
}

void ThermalModel::initialise(double) {
  std::fill(memory_.begin(), memory_.end(), 0.0);
  has_warned_ = false;
}

Drive ThermalModel::drive() const {
  Drive drive{data_.V, data_.delta, data_.T_ambient};
  drive.ambient_rise[0] -= data_.parameters.T_0;
  return drive;
}

fmu::StepResult ThermalModel::step(double t, double h) {
  try {
    level_->advance(memory_, drive(), h, data_.parameters.tolerance);
  } catch (const std::exception& problem) {
    std::ostringstream text;
    text << "heat, step from t = " << t << " s of " << h << " s: " << problem.what();
    throw fmu::Error(text.str());
  }
  if (!std::all_of(memory_.begin(), memory_.end(), [](double v) { return std::isfinite(v); })) {
    throw fmu::Error("heat: temperatures beyond all numbers after the step from t = " + std::to_string(t) +
                     " s; reduce the voltages or their derivatives");
  }
  return {t + h, {}};
}

std::string ThermalModel::without_states() const {
  if (data_.parameters.level == Level::full)
    return "level = full has as many states as its mesh has nodes; choose reduced or lumped";
  if (level_->amplitudes() > kMostAmplitudes)
    return "level = reduced has " + std::to_string(level_->amplitudes()) + " states, allowed: up to " +
           std::to_string(kMostAmplitudes) + "; choose a larger tolerance";
  return "";
}

void ThermalModel::get_states(std::span<double> x) {
  if (without_states().empty()) level_->get_amplitudes(memory_, x);
}

void ThermalModel::set_states(std::span<const double> x) { level_->set_amplitudes(memory_, x); }

std::string ThermalModel::rates(double, std::span<double> dx) {
  try {
    level_->rates(memory_, drive(), dx);
  } catch (const std::domain_error& problem) {
    return problem.what();
  }
  return "";
}

void ThermalModel::evaluate(double t) {
  const double T_0 = data_.parameters.T_0;
  Observation seen;
  try {
    seen = level_->observe(memory_, drive());
  } catch (const std::domain_error& problem) {
    throw fmu::Error("heat, t = " + std::to_string(t) + " s: " + problem.what());
  }
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
}

}  // namespace thermal
