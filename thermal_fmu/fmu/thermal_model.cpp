#include "fmu/thermal_model.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "fmu/model_cache.hpp"
#include "levels/full_level.hpp"
#include "levels/modal_level.hpp"
#include "mesh/heat_section.hpp"
#include "mesh/resolution.hpp"
#include "reduction/modal_model.hpp"

namespace thermal {
namespace {

constexpr double kHottest = 373.15;           // where the paper's assumptions end [K]
constexpr double kReferenceTolerance = 1e-4;  // of the model that `lumped` is compared with

constexpr unsigned kHotWarning = 0, kAccuracyWarning = 1;  // bits of Model::warn_once

/// "asked, reached" for a quantity in units of the rise that tolerances refer to.
std::string shortfall(const char* what, double asked, double reached, const char* remedy) {
  std::ostringstream text;
  text << what << ": tolerance asks for " << asked << " of the rise of a heated TCA, reached is " << reached << "; "
       << remedy;
  return text.str();
}

/// The error of the mesh belongs to the bound where it is not below the tolerance.
void include_mesh_error(const HeatSection& section, double tolerance, ModalModel& model) {
  if (!(section.error > tolerance)) return;
  const Eigen::Index n = section.tcas;
  model.step_bound.leftCols(n).colwise() += section.error * model.reference;
  model.step_bound.rightCols(1).array() += section.error;  // 1 K of the surroundings in the end is 1 K everywhere
  model.bound += section.error;
}

}  // namespace

Status ThermalModel::build() {
  if (data_.parameters.convection != ConvectionKind::constant && data_.parameters.level == Level::reduced)
    return Status::error("level = reduced is linear in the temperatures, convection = free and forced are not",
                         "choose level = full or lumped, or convection = constant with a mean h");
  if (level_ && built_.has_same_section(data_.parameters)) {
    memory_.assign(level_->state_size(), 0.0);
    return retune(0.0);
  }
  const Parameters& p = data_.parameters;
  if (std::optional<DerivedModel> known = find_derived(p)) {
    accuracy_ = std::move(known->accuracy);
    adopt(make_modal_level(std::move(known->model), p));
    return {};
  }
  core::Result<HeatSection> section = resolved_section(p);
  if (!section.status.is_ok()) return std::move(section.status);
  accuracy_.clear();
  if (section.value.error > p.tolerance)
    accuracy_ = shortfall("the mesh ends at its highest order", p.tolerance, section.value.error,
                          "enlarge tca.outer_radius or the gaps between TCAs, or loosen tolerance");
  core::Result<HeatMatrices> matrices;
  if (p.level != Level::reduced) matrices = matrices_of(section.value, p);
  if (!matrices.status.is_ok()) return std::move(matrices.status);
  if (p.level == Level::full) {
    adopt(std::make_unique<FullLevel>(matrices.value, p));
  } else {
    // A reduction that is finer than its mesh says nothing more, and costs most where the mesh is hardest to resolve.
    const auto no_finer_than_mesh = [&](double asked) { return std::max(asked, section.value.error); };
    ModalModel model = p.level == Level::reduced
                           ? reduced(section.value, no_finer_than_mesh(p.tolerance))
                           : lumped(matrices.value, reduced(section.value, no_finer_than_mesh(kReferenceTolerance)));
    include_mesh_error(section.value, p.tolerance, model);
    if (accuracy_.empty() && model.bound > p.tolerance)
      accuracy_ =
          p.level == Level::reduced
              ? shortfall("level = reduced ends at its largest search space", p.tolerance, model.bound,
                          "loosen tolerance or choose level = full; reduction.bound holds")
              : shortfall("level = lumped is a network of few nodes", p.tolerance, model.bound,
                          "choose level = reduced, or tolerance = 0.1 where this is enough; reduction.bound holds");
    keep_derived({p, model, accuracy_});
    adopt(make_modal_level(std::move(model), p));
  }
  return {};
}

void ThermalModel::adopt(std::unique_ptr<HeatLevel> level) {
  level_ = std::move(level);
  memory_.assign(level_->state_size(), 0.0);
  built_ = data_.parameters;
}

Status ThermalModel::retune(double) {
  level_->retune(data_.parameters);
  return {};
}

Status ThermalModel::initialise(double) {
  std::fill(memory_.begin(), memory_.end(), 0.0);
  if (!accuracy_.empty()) warn_once(kAccuracyWarning, [&] { return accuracy_; });
  return {};
}

Drive ThermalModel::drive() const {
  Drive drive{data_.V, data_.delta, data_.T_ambient, data_.air_speed};
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
  return {t, std::move(status).at(where.str())};
}

Status ThermalModel::check_states() const {
  if (data_.parameters.level == Level::full)
    return Status::error("level = full has as many states as its mesh has nodes", "choose reduced or lumped");
  const std::size_t most = most_amplitudes(data_.parameters.tca.count);
  if (level_->amplitudes() > most)
    return Status::error("level = reduced has " + std::to_string(level_->amplitudes()) + " states, allowed: up to " +
                             std::to_string(most),
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
  // Where the host integrates, states may be anything.
  if (is_silent)
    if (Status status = level_->check_amplitudes(memory_); !status.is_ok()) return status;
  Observation seen;
  if (Status status = level_->observe(memory_, drive(), seen); !status.is_ok()) return std::move(status).at("heat");
  for (std::size_t i = 0; i < data_.parameters.tca.count; ++i) data_.T[i] = T_0 + seen.rise[i];
  data_.T_rate = seen.rate;
  data_.P = seen.power;
  data_.Q_loss = seen.loss;
  data_.E_stored = seen.stored;
  data_.T_surface = T_0 + seen.surface_rise;
  data_.coefficient = seen.coefficient;
  data_.reduction_bound = seen.bound;
  data_.reduction_states = static_cast<double>(level_->unknowns());
  if (level_->exceeds(memory_, kHottest - T_0))
    warn_once(kHotWarning, [&] {
      std::ostringstream text;
      text << "t = " << t << " s: the hottest point of the section is at " << T_0 + level_->max_rise(memory_) - 273.15
           << " degC, above 100 degC the model's assumptions end; reduce the voltages";
      return text.str();
    });
  return {};
}

Status ThermalModel::evaluate_on_demand(double, unsigned) {
  data_.T_max = data_.parameters.T_0 + level_->max_rise(memory_);
  return {};
}

}  // namespace thermal
