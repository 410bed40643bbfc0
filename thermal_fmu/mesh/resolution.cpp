#include "mesh/resolution.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "mesh/insulated.hpp"
#include "mesh/symmetric_factor.hpp"

namespace thermal {
namespace {

using Eigen::MatrixXd;

constexpr std::array<double, 3> kFrequencies{1e2, 1e4, 1e5};  // of dynamic responses, in units of the slowest rate

/// What responses of all orders are measured in. One order's own response as its unit would hide that response's error.
struct Units {
  double rise = 0.0;     // reference rise of the TCA that heats most [K/W]
  double slowest = 0.0;  // rate [1/s]
  bool is_insulated = false;
};

/// Responses loads' (stiffness + s mass)^-1 loads of a section at one order.
class Responses {
 public:
  explicit Responses(const HeatSection& section) : section_(section) {
    for (const HeatPart& part : section.parts) factors_.emplace_back(part.system.stiffness, part.system.mass);
  }

  Units units() const {
    Units units;
    const Eigen::Index tcas = section_.tcas;
    Eigen::Index hottest = 0;
    const MatrixXd steady = at(std::array{0.0})[0];
    const double rise = steady.topLeftCorner(tcas, tcas).diagonal().maxCoeff(&hottest);
    const double above = rise - steady(tcas, hottest) / section_.surface_conductance;
    units.is_insulated = is_insulated(rise, above);
    units.rise = units.is_insulated ? kSurfaceShare * rise_above_surface() : reference_rise(rise, above);
    units.slowest = 1.0 / (units.rise * heat_capacity(section_));
    return units;
  }

  /// The TCAs' part in the reference rise, (TCAs) x (TCAs, surroundings).
  struct OfTcas {
    MatrixXd steady;   // zero for an insulated section: 1/(h S) whatever the mesh
    MatrixXd dynamic;  // those of all frequencies, side by side
  };
  OfTcas of_tcas(const Units& units) const {
    const Eigen::Index tcas = section_.tcas, channels = tcas + 1;
    std::array<double, kFrequencies.size() + 1> frequencies{};
    for (std::size_t k = 0; k < kFrequencies.size(); ++k) frequencies[k + 1] = kFrequencies[k] * units.slowest;
    const std::vector<MatrixXd> responses = at(frequencies);
    OfTcas result{MatrixXd::Zero(tcas, channels),
                  MatrixXd(tcas, channels * static_cast<Eigen::Index>(kFrequencies.size()))};
    if (!units.is_insulated) result.steady = scaled(responses[0], units);
    for (std::size_t k = 0; k < kFrequencies.size(); ++k)
      result.dynamic.middleCols(static_cast<Eigen::Index>(k) * channels, channels) = scaled(responses[k + 1], units);
    return result;
  }

 private:
  /// Response of each TCA and the surface (rows) to heat in each TCA and at the surface (columns).
  std::vector<MatrixXd> at(std::span<const double> frequencies) const {
    std::vector<MatrixXd> sums(frequencies.size(), MatrixXd::Zero(section_.tcas + 1, section_.tcas + 1));
    for (std::size_t part = 0; part < factors_.size(); ++part) {
      const MatrixXd& loads = section_.parts[part].system.loads;
      const std::vector<MatrixXd> solutions = factors_[part].solve(frequencies, loads);
      for (std::size_t k = 0; k < sums.size(); ++k)
        add_response(section_.parts[part], loads.transpose() * solutions[k], sums[k]);
    }
    return sums;
  }

  double rise_above_surface() const {
    MatrixXd sum = MatrixXd::Zero(section_.tcas + 1, section_.tcas + 1);
    for (std::size_t k = 0; k < factors_.size(); ++k) {
      const HeatPart& part = section_.parts[k];
      const Eigen::Index loads = part.system.loads.cols();
      MatrixXd of_part = MatrixXd::Zero(loads, loads);
      if (part.has_surface) {
        of_part.leftCols(loads - 1) = part.system.loads.transpose() * rises_above_surface(part.system);
      } else {
        of_part = part.system.loads.transpose() * factors_[k].solve(std::array{0.0}, part.system.loads)[0];
      }
      add_response(part, of_part, sum);
    }
    return sum.topLeftCorner(section_.tcas, section_.tcas).diagonal().maxCoeff();
  }

  MatrixXd scaled(const MatrixXd& response, const Units& units) const {
    MatrixXd result = response.topRows(section_.tcas) / units.rise;
    result.col(section_.tcas) *=
        std::sqrt(units.rise / section_.surface_conductance);  // so that it counts like a TCA's
    return result;
  }

  const HeatSection& section_;
  std::vector<SymmetricFactor> factors_;
};

/// Changes of a response from order to order, taken for a geometric series.
class Changes {
 public:
  void add(MatrixXd response) {
    const double change = last_.size() > 0 ? (response - last_).cwiseAbs().maxCoeff() : 0.0;
    ratio_ = change_ > 0.0 ? std::min(kSlowest, change / change_) : kFirst;
    least_ = change_ > 0.0 ? kLeast : kFirst;
    change_ = change;
    last_ = std::move(response);
  }
  double error_before() const { return change_ / (1.0 - ratio_); }
  double error() const { return error(ratio_); }
  double cautious_error() const { return error(std::max(ratio_, least_)); }

 private:
  // Ratio of a change to the one before it: of the first change; the least that later ones are expected to be, since
  // where walls are thin it is 0.1 at order 4 and 0.4 at order 5; the largest that is taken.
  static constexpr double kFirst = 0.3, kLeast = 0.4, kSlowest = 0.95;

  double error(double ratio) const { return change_ * ratio / (1.0 - ratio); }

  MatrixXd last_;
  double change_ = 0.0, ratio_ = kFirst, least_ = kFirst;
};

}  // namespace

core::Result<HeatSection> resolved_section(const Parameters& parameters) {
  core::Result<HeatSection> coarser;
  Units units;
  Changes steady, dynamic;
  for (int order = kLeastOrder - 1;; ++order) {
    core::Result<HeatSection> here = heat_section(parameters, order);
    if (!here.status.is_ok()) return here;
    const Responses responses(here.value);
    if (order < kLeastOrder) units = responses.units();
    here.value.is_insulated = units.is_insulated;
    Responses::OfTcas of_tcas = responses.of_tcas(units);
    steady.add(std::move(of_tcas.steady));
    if (order > kLeastOrder) {
      coarser.value.error = std::max(steady.error_before(), dynamic.error());
      if (coarser.value.error <= parameters.tolerance) return coarser;
    }
    dynamic.add(std::move(of_tcas.dynamic));
    here.value.error = std::max(steady.cautious_error(), dynamic.error());
    if (order >= kLeastOrder && (here.value.error <= parameters.tolerance || order == kHighestOrder)) return here;
    coarser = std::move(here);
  }
}

core::Result<HeatMatrices> matrices_of(const HeatSection& section, const Parameters& parameters) {
  core::Result<HeatMatrices> matrices = heat_matrices(parameters, section.order);
  matrices.value.is_insulated = section.is_insulated;
  matrices.value.error = section.error;
  return matrices;
}

core::Result<HeatMatrices> resolved_matrices(const Parameters& parameters) {
  core::Result<HeatSection> section = resolved_section(parameters);
  if (!section.status.is_ok()) return std::move(section.status);
  return matrices_of(section.value, parameters);
}

}  // namespace thermal
